//! [`Toolpath`](crate::toolpath::Toolpath) -> text by dialect.
