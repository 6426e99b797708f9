//! A hash that is the same on every machine and with every compiler, for what is kept in files or compared between ranks.

/// FNV-1a with 64 bits (Fowler, Noll, Vo; draft-eastlake-fnv). It tells inputs apart; it is no defence against somebody who
/// looks for two of the same hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StableHash(u64);

impl StableHash {
    /// Of nothing: the offset basis of FNV-1a.
    pub fn new() -> StableHash {
        StableHash(0xcbf2_9ce4_8422_2325)
    }

    /// With these bytes after the others.
    pub fn bytes(self, bytes: &[u8]) -> StableHash {
        // The prime of FNV with 64 bits.
        StableHash(bytes.iter().fold(self.0, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3)))
    }

    /// With a field: its length, then its bytes, so that "ab", "c" is not "a", "bc".
    pub fn field(self, bytes: &[u8]) -> StableHash {
        self.bytes(&(bytes.len() as u64).to_le_bytes()).bytes(bytes)
    }

    /// The number.
    pub fn finish(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of the draft.
    #[test]
    fn it_is_fnv_1a() {
        for (text, value) in
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
        {
            assert_eq!(StableHash::new().bytes(text.as_bytes()).finish(), value, "{text}");
        }
        let of = |fields: [&str; 2]| fields.iter().fold(StableHash::new(), |h, f| h.field(f.as_bytes()));
        assert_ne!(of(["ab", "c"]), of(["a", "bc"]));
    }
}
