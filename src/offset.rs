//! Heightfield x cutter -> tool-tip field and exact drops at points.
