"""survey.toml and project.toml, and all files that they name, as one Survey or Project.

- survey_file, project_file: read whole, with all that is wrong in one error
- survey_sections, project_sections: what these files may state
- survey_paths, survey_scanners, session_points, surveyed_points: which file belongs to what
- survey_copy, folder_roles, simulated_clouds, crs_checks: survey.toml written anew, found, checked
"""
