//! Alias tables.
