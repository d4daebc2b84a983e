"""The report of a correction: figures and one self-contained page."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "_calibration_page": ["calibration_page", "calibration_screen", "scanners_screen"],
        "_comparison_screen": ["comparison_screen", "method_warnings"],
        "_show": ["show"],
        "_results_screen": ["results_screen"],
        "cloud": ["view_cloud"],
        "comparison_page": ["comparison_figure", "write_comparison"],
        "correction_page": ["write_report"],
        "correction_report": ["CorrectionReport", "Coverage", "FileRow"],
        "figures": ["correction_figures", "write_pictures"],
        "geometry": ["correction_lines", "misclosure_lines", "target_lines", "tie_lines"],
        "headline": ["RATINGS", "StatementRow", "capped", "first_screen", "statements_section"],
        "maps": ["search_figure"],
        "project_page": ["write_project"],
        "results_page": ["results_figure", "write_results"],
        "stage_figures": [
            "misclosure_figure",
            "pos_error_figure",
            "score_figure",
            "targets_figure",
        ],
        "style": ["draw"],
        "target_figures": ["write_contact_sheet"],
        "tables": ["tie_sentences"],
    },
)
