//! Plain moves, one after another -> time, speed, position: GRBL's planner as a model, incremental.
