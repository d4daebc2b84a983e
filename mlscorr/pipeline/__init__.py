"""The story from files to files, one module a command, each loaded when it is used."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "applying": ["AppliedSurvey", "apply"],
        "blind": ["make_blind", "run_blind", "score_blind"],
        "calibration": ["CalibratedScanners", "CalibratedSurvey", "calibrate"],
        "checking": ["CheckedSurvey", "check"],
        "compared_results": ["ComparedResults", "compare_results", "is_result"],
        "comparison": ["ComparedSurvey", "compare"],
        "corrected_survey": ["CorrectedSurvey"],
        "correction": ["correct"],
        "diagnosis": ["DiagnosedSurvey", "diagnose", "diagnose_until_none"],
        "estimation": ["PosErrorEstimate", "Scores", "estimate_pos_error", "score"],
        "extraction": ["ExtractedSurvey", "extract"],
        "finding": ["FoundTargets", "MatchedTargets", "find_targets", "match_targets"],
        "found_effects": ["read_effects"],
        "installation": ["Installation", "doctor"],
        "methods": ["method_named"],
        "planning": ["PlannedSurvey", "plan"],
        "rendering": ["render"],
        "simulation": ["demo", "simulate_survey"],
        "starting": ["StartedSurvey", "init"],
        "ties": ["TiedSurvey", "find_ties"],
    },
)
