//! What the benchmarks against other programs share.
#![allow(dead_code)]

pub mod calculix;
pub mod decks;
pub mod getfem;
