//! kontakt
fn main() {}
