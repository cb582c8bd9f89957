//! Procedural, seeded scenes.
