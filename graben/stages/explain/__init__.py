"""explain: what a run will model, leave out and cost; settings that fit a budget of time."""
