//! The root of an increasing function of one variable.

/// A function at a point.
pub(super) struct Sample {
    /// f.
    pub value: f64,
    /// df/dx > 0; it may be infinite.
    pub slope: f64,
    /// |f| that is round-off.
    pub noise: f64,
}

/// Newton's method kept inside a bracket that shrinks; bisection where Newton leaves it, and now and then once many
/// iterations have passed, so that kinks cannot make it cycle. The result is where `f` was asked last.
pub(super) fn root(start: f64, bracket: (f64, f64), mut f: impl FnMut(f64) -> Sample) -> f64 {
    let (mut low, mut high) = bracket;
    let mut x = start;
    for iteration in 0.. {
        let Sample { value, slope, noise } = f(x);
        if value.abs() <= noise {
            break;
        }
        if value < 0. {
            low = low.max(x);
        } else {
            high = high.min(x);
        }
        let newton = x - value / slope;
        let bisects = iteration > 12 && iteration % 3 == 0 && (high - low).is_finite();
        let next = if newton > low && newton < high && !bisects { newton } else { 0.5 * (low + high) };
        if next == x || !next.is_finite() || iteration == 100 {
            break;
        }
        x = next;
    }
    x
}
