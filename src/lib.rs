//! `relievo` turns layered, flat, closed artwork into a wood carving.
//!
//! It builds a relief surface for each layer, merges the layers into one heightfield, plans toolpaths
//! with exact cutter offsets, proves the G-code by a dry run and hands over programs and pictures.
//!
//! Data flows one way, from the top of this table to the bottom. A module uses only the modules that
//! its row names; `tests/layering.rs` reads the table and the sources and fails on anything else.
//!
//! | module | takes -> gives | may use |
//! |---|---|---|
//! | `geom` | points, bounds, exact orientation, polygons, arcs, plain moves, `Heightfield` (the grid itself), `Tolerance` | - |
//! | `job` | design TOML + machine, cutter and wood tables -> a checked `Job`; every default in one table | geom |
//! | `cutter` | cutter shapes: height of the profile at a radius, tip, flank, shank, holder | geom job |
//! | `artwork` | SVG bytes -> curves by layer, closed or open, every one resolved or refused | geom job |
//! | `outline` | curves -> `Region`s (outer ring + holes): flatten, resolve, orient, nest | geom job artwork |
//! | `surface` | region + layer settings -> `Mesh` or height field; one file per method | geom job outline |
//! | `relief` | layers' surfaces -> the relief heightfield: rasterise, combine, blend, background: the *target* | geom job outline surface |
//! | `offset` | heightfield x cutter -> tool-tip field and exact drops at points | geom job cutter relief |
//! | `stock` | the wood as a heightfield; removes plain moves of a cutter from it | geom job cutter |
//! | `motion` | plain moves, one after another -> time, speed, position: GRBL's planner as a model, incremental | geom job |
//! | `toolpath` | target, offset, stock, operation -> `Toolpath`: rough, raster, linking, fitting, feeds | geom job cutter outline relief offset stock motion |
//! | `gcode` | `gcode::write`: `Toolpath` -> text by dialect. `gcode::read`: text -> plain moves with line numbers. Neither imports the other | geom job toolpath (write only) |
//! | `proof` | program text + job -> verdict (gouge, leftover, rapids, envelope, feeds, time) | geom job cutter relief stock motion gcode::read |
//! | `report` | pictures (PNG), HTML report, mesh export, summaries | all above |
//! | `cli` | one file per command; the only place with files, clock, terminal, fonts, ports | all |
//!
//! All lengths are millimetres, X right, Y up, Z up; Z = 0 is the top of the stock.

pub mod geom;
pub mod job;
pub mod cutter;
pub mod artwork;
pub mod outline;
pub mod surface;
pub mod relief;
pub mod offset;
pub mod stock;
pub mod motion;
pub mod toolpath;
pub mod gcode;
pub mod proof;
pub mod report;
