//! Program text + job -> verdict (gouge, leftover, rapids, envelope, feeds, time).
