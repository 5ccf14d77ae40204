//! Pictures (PNG), HTML report, mesh export, summaries.
