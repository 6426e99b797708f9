//! How an adaptive run ended.
use crate::record::{AdaptRound, Summary};

/// Reached, or why not.
pub(super) type Verdict = std::result::Result<(), String>;

/// The rounds that were made, and whether the target is reached or why not.
pub(super) struct Adapted {
    pub rounds: Vec<AdaptRound>,
    pub verdict: Verdict,
    pub warning: Option<String>,
}

impl Adapted {
    pub fn report(self, summary: &mut Summary) {
        summary.adapt = Some(self.rounds);
        summary.adapt_reached = Some(self.verdict.is_ok());
        summary.warnings.extend(self.warning);
        summary
            .diagnosis
            .extend(self.verdict.err().map(|why| format!("adaptive refinement: target not reached: {why}")));
    }
}
