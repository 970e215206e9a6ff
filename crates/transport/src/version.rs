//! The version of what processes share: an agent that was built of another one must not join.

/// Raised whenever a message or another page of shared memory changes its layout. iceoryx2 compares the names and sizes of types,
/// and would let two fields change places.
pub(crate) const VERSION: u8 = b'4';

#[cfg(test)]
mod tests {
    use super::*;

    /// The structs of a source file as they lie in memory: their lines without comments.
    fn layouts(source: &str) -> String {
        let mut layouts = String::new();
        let mut inside = false;
        for line in source.lines().map(str::trim) {
            inside |= line.starts_with("#[repr(C");
            if inside && !line.starts_with("//") && !line.starts_with("#[derive") {
                layouts += line;
                layouts += "\n";
            }
            inside &= !(line == "}" || line.ends_with(");"));
        }
        layouts
    }

    /// FNV-1a.
    fn fingerprint(text: &str) -> u64 {
        text.bytes()
            .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
    }

    #[test]
    fn layouts_are_those_of_this_version() {
        let layouts = [include_str!("raw.rs"), include_str!("doorbell.rs")].map(layouts).concat();
        for part in ["pub struct RawCommand", "pub struct RawFrame", "pub struct RawLongFrame", "struct Page"]
        {
            assert!(layouts.contains(part), "{part} is not among\n{layouts}");
        }
        assert_eq!(
            (VERSION, fingerprint(&layouts)),
            (b'4', 0x2688_f5ea_a2ac_5681),
            "a layout has changed: raise VERSION, and write both numbers here"
        );
    }
}
