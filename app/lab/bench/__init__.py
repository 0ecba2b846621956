"""The accuracy and speed tables: every method on every rendered scenario, in one run.

Where the stated rig is wrong, or silt lies in the pipe, Chainage's run is also corrected by the
joints that it saw, as `chainage correct --joints` does.

- `targets`: what Chainage must reach on each scenario.
- `run`: renders the scenarios, runs the methods and times them.
- `tables`: writes the results as Markdown.
- `choices`: which scenarios, methods and tables an option of `chainage bench` chooses.
"""
