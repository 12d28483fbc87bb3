//! Tests that span the crate.
