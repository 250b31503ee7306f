//! Numbers as files store them: kind, width and byte order.

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum NumberKind {
    Float,
    Signed,
    Unsigned,
    Flag,
}

/// Type and byte order of a stored number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DType {
    pub kind: NumberKind,
    pub bytes: usize,
    pub big: bool,
}

impl DType {
    /// `None` for a width that is not read.
    pub(crate) fn new(kind: NumberKind, bytes: usize, big: bool) -> Option<DType> {
        let widths = match kind {
            NumberKind::Float => &[2, 4, 8][..],
            NumberKind::Signed | NumberKind::Unsigned => &[1, 2, 4, 8],
            NumberKind::Flag => &[1],
        };
        widths.contains(&bytes).then_some(DType { kind, bytes, big })
    }

    /// Parses a NumPy descriptor: byte order (`|` if not applicable), kind and width.
    pub(crate) fn named(descriptor: &str) -> Option<DType> {
        let (kind, bytes) = descriptor.strip_prefix(['<', '>', '|'])?.split_at_checked(1)?;
        let kind = match kind {
            "f" => NumberKind::Float,
            "i" => NumberKind::Signed,
            "u" => NumberKind::Unsigned,
            "b" => NumberKind::Flag,
            _ => return None,
        };
        DType::new(kind, bytes.parse().ok()?, descriptor.starts_with('>'))
    }

    /// Converts `values.len()` numbers.
    pub(crate) fn values(self, bytes: &[u8], values: &mut [f64]) {
        match (self.kind, self.bytes, self.big) {
            // Fast path for the types that this program writes.
            (NumberKind::Float, 8, false) => {
                values.iter_mut().zip(bytes.as_chunks().0).for_each(|(v, b)| *v = f64::from_le_bytes(*b));
            }
            (NumberKind::Float, 4, false) => {
                values.iter_mut().zip(bytes.as_chunks().0).for_each(|(v, b)| *v = f32::from_le_bytes(*b).into());
            }
            _ => values.iter_mut().zip(bytes.chunks_exact(self.bytes)).for_each(|(v, b)| *v = self.value(b)),
        }
    }

    pub(crate) fn value(self, b: &[u8]) -> f64 {
        // The bytes of the number as the low ones of a word.
        let mut word = [0; 8];
        word[..self.bytes].copy_from_slice(&b[..self.bytes]);
        if self.big {
            word[..self.bytes].reverse();
        }
        let bits = u64::from_le_bytes(word);
        match (self.kind, self.bytes) {
            (NumberKind::Float, 8) => f64::from_bits(bits),
            (NumberKind::Float, 4) => f32::from_bits(bits as u32).into(),
            (NumberKind::Float, _) => half::f16::from_bits(bits as u16).into(),
            // The left shift puts the sign bit at the top; the arithmetic right shift extends it.
            (NumberKind::Signed, bytes) => {
                let unused = 64 - 8 * bytes as u32;
                (((bits << unused) as i64) >> unused) as f64
            }
            (NumberKind::Unsigned | NumberKind::Flag, _) => bits as f64,
        }
    }
}
