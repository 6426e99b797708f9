//! `expected.toml`: what a hard case states about itself.
use serde::Deserialize;
use std::path::Path;

/// The file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Relative difference that the swap of the sides may make; 0 or absent: not swapped.
    pub swap: Option<f64>,
    /// The runs, each the case as written or a variant.
    pub run: Vec<Run>,
}

/// The case as written, or a variant.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Name of the variant.
    pub variant: Option<String>,
    /// `converged`, `open`, `no_contact`, `refused`, or `touching`: no force acts, and whether nodes that just touch
    /// count as closed is round-off.
    #[serde(default = "converged")]
    pub outcome: String,
    /// Exit code of a refusal.
    pub exit: Option<i32>,
    /// Texts that the refusal must contain.
    #[serde(default)]
    pub message: Vec<String>,
    /// What is other with `geometry = "updated"`.
    pub updated: Option<Updated>,
    /// What is other with friction in all pairs.
    #[serde(default)]
    pub friction: Vec<WithFriction>,
    /// Most alternations allowed in a load step, on every number of ranks.
    #[serde(default = "alternations")]
    pub alternations_max: u64,
    /// Numbers of ranks.
    #[serde(default = "ranks")]
    pub ranks: Vec<usize>,
    /// One of the quick subset.
    #[serde(default)]
    pub quick: bool,
    /// Takes more than a few seconds.
    #[serde(default)]
    #[allow(dead_code)]
    pub slow: bool,
    /// In place of the file's.
    pub swap: Option<f64>,
    /// Relative accuracy that double precision allows forces to follow from displacements with, in the stiffest body or
    /// near incompressibility: 10 ulp(u) E / (h p), eps / (1 - 2 nu). Residual, work and the agreement between numbers
    /// of ranks are not asked for more.
    #[serde(default)]
    pub round_off: f64,
    /// Parts that contact does not hold rest in more than one place: which of their nodes touch without force, and where
    /// they are, is not compared between numbers of ranks.
    #[serde(default)]
    pub loose: bool,
    /// Rigid motions left free.
    pub free_modes: Option<u64>,
    /// At least so many rigid motions left free.
    pub free_modes_min: Option<u64>,
    /// Body and mode that must be among them.
    #[serde(default)]
    pub mode: Vec<String>,
    /// Symmetric about x = 0: largest difference of displacements, relative to the largest displacement.
    pub symmetric: Option<f64>,
    /// Numbers of the summary.
    #[serde(default)]
    pub values: Vec<Number>,
    /// Pressures along a contact surface.
    #[serde(default)]
    pub profile: Vec<Profile>,
    /// Powers with which pressures grow towards a corner.
    #[serde(default)]
    pub slope: Vec<Slope>,
    /// Other runs that must agree.
    #[serde(default)]
    pub same: Vec<Same>,
}

/// How the run with `geometry = "updated"` differs; its numbers are then not looked at.
#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub struct Updated {
    /// Why.
    #[allow(dead_code)]
    pub because: String,
    /// In place of the run's.
    pub outcome: Option<String>,
    /// Exit code of a refusal.
    pub exit: Option<i32>,
}

/// How the run with friction in all pairs differs.
#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub struct WithFriction {
    /// Why.
    #[allow(dead_code)]
    pub because: String,
    /// With these coefficients.
    pub coefficients: Vec<f64>,
    /// In place of the run's.
    pub outcome: String,
    /// Exit code.
    pub exit: Option<i32>,
}

/// A number of the summary.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Number {
    /// Where it is: `pairs.contact.normal_force`.
    pub path: String,
    /// What it should be.
    pub value: f64,
    /// Relative difference allowed.
    #[serde(default)]
    pub relative: f64,
    /// Absolute difference allowed, added.
    #[serde(default)]
    pub absolute: f64,
}

/// Pressures along a contact surface.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Name of the pair.
    pub pair: String,
    /// The pressure of all nodes in contact, Pa ...
    pub uniform: Option<f64>,
    /// ... or pressures at these x, m.
    #[serde(default)]
    pub at: Vec<f64>,
    /// The pressures at `at`, Pa.
    #[serde(default)]
    pub pressure: Vec<f64>,
    /// Relative difference allowed.
    #[serde(default)]
    pub relative: f64,
    /// Absolute difference allowed, added, Pa.
    #[serde(default)]
    pub absolute: f64,
}

/// The power of the distance from a corner with which the pressure grows: slope of log p over log d.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slope {
    /// Name of the pair.
    pub pair: String,
    /// x of the corner, m.
    pub corner: f64,
    /// Smallest distance, m.
    pub from: f64,
    /// Largest distance, m.
    pub to: f64,
    /// The power.
    pub value: f64,
    /// Difference allowed.
    pub absolute: f64,
}

/// Another run that must agree: what is compared with, times factors, is what should be found.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Same {
    /// Another case of cases/hard; absent: this one.
    pub case: Option<String>,
    /// Its variant.
    pub variant: Option<String>,
    /// Relative difference allowed.
    pub relative: f64,
    /// Factor on lengths.
    #[serde(default = "one")]
    pub length: f64,
    /// Factor on pressures.
    #[serde(default = "one")]
    pub pressure: f64,
    /// Factor on displacements; absent: that on lengths.
    pub displacement: Option<f64>,
    /// Difference of the alternations allowed; absent: any.
    pub alternations: Option<u64>,
}

fn converged() -> String {
    "converged".into()
}

fn ranks() -> Vec<usize> {
    vec![1, 2, 4]
}

/// What no hard case may need more of.
fn alternations() -> u64 {
    60
}

fn one() -> f64 {
    1.0
}

/// The expectations of a case.
pub fn read(directory: &Path) -> Expected {
    let file = directory.join("expected.toml");
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}
