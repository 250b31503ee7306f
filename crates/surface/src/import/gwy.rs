use super::bytes::{self, Bytes, F64, I32};
use super::content::{ImportOptions, ImportedFile};
use crate::declared::{Declared, DeclaredExtent};
use crate::heights::HeightMap;
use asperity_grid::error::{Error, Result};
use asperity_grid::units::metres_per;
use std::collections::BTreeMap;
use std::path::Path;

const MAGIC: &[u8] = b"GWYP";

pub(super) fn starts(start: &[u8]) -> bool {
    start.starts_with(MAGIC)
}

/// Masked points have 1; partial masks are rounded.
const MASKED: f64 = 0.5;

/// Components of a stored object that are used.
enum GwyValue<'a> {
    Int(f64),
    Double(f64),
    Text(String),
    Object(Bytes<'a>),
    Doubles(Bytes<'a>),
    Other,
}

/// Calls `each` for the components of an object: name, code of the type, value. `body`: its bytes after name and size.
fn components<'a>(
    path: &'a Path,
    mut body: Bytes<'a>,
    mut each: impl FnMut(String, GwyValue<'a>) -> Result<()>,
) -> Result<()> {
    while !body.left().is_empty() {
        let name = body.text("the name of a component")?;
        // For messages, of one line whatever the name is.
        let quoted = format!("{name:?}");
        let value = match body.take(1, "the type of a component")?[0] {
            b'b' | b'c' => skip(&mut body, 1)?,
            b'i' => GwyValue::Int(body.number(I32, &quoted)?),
            b'q' => skip(&mut body, 8)?,
            b'd' => GwyValue::Double(body.number(F64, &quoted)?),
            b's' => GwyValue::Text(body.text(&quoted)?),
            b'o' => GwyValue::Object(object(path, &mut body)?.1),
            b'C' => skip_list(&mut body, 1)?,
            b'I' => skip_list(&mut body, 4)?,
            b'Q' => skip_list(&mut body, 8)?,
            b'D' => {
                let count = body.count(&quoted)?;
                GwyValue::Doubles(Bytes::of(path, body.take(count.saturating_mul(8), &quoted)?))
            }
            code @ (b'S' | b'O') => {
                for _ in 0..body.count(&quoted)? {
                    if code == b'S' {
                        body.text(&quoted)?;
                    } else {
                        object(path, &mut body)?;
                    }
                }
                GwyValue::Other
            }
            code => {
                let found = format!("component {name:?} of type {:?}", char::from(code));
                return Err(Error::format(path, found, "a type of Gwyddion (the file is damaged)"));
            }
        };
        each(name, value)?;
    }
    Ok(())
}

fn skip<'a>(body: &mut Bytes, count: usize) -> Result<GwyValue<'a>> {
    body.take(count, "a component")?;
    Ok(GwyValue::Other)
}

fn skip_list<'a>(body: &mut Bytes, bytes: usize) -> Result<GwyValue<'a>> {
    let count = body.count("the length of a component")?;
    skip(body, count.saturating_mul(bytes))
}

/// Name and components of the object that comes next.
fn object<'a>(path: &'a Path, body: &mut Bytes<'a>) -> Result<(String, Bytes<'a>)> {
    let name = body.text("the name of an object")?;
    let size = body.count("the size of an object")?;
    let inside = body.take(size, &format!("an object {name:?}"))?;
    Ok((name, Bytes::of(path, inside)))
}

/// A `GwyDataField`.
#[derive(Default)]
struct GwyField<'a> {
    nx: usize,
    ny: usize,
    x: f64,
    y: f64,
    unit_xy: String,
    unit_z: String,
    values: Option<Bytes<'a>>,
}

impl<'a> GwyField<'a> {
    fn of(path: &'a Path, body: Bytes<'a>) -> Result<Self> {
        let mut field = GwyField::default();
        components(path, body, |name, value| {
            match (name.as_str(), value) {
                ("xres", GwyValue::Int(n)) if n > 0.0 => field.nx = n as usize,
                ("yres", GwyValue::Int(n)) if n > 0.0 => field.ny = n as usize,
                ("xreal", GwyValue::Double(x)) => field.x = x,
                ("yreal", GwyValue::Double(y)) => field.y = y,
                ("si_unit_xy", GwyValue::Object(unit)) => field.unit_xy = unit_of(path, unit)?,
                ("si_unit_z", GwyValue::Object(unit)) => field.unit_z = unit_of(path, unit)?,
                ("data", GwyValue::Doubles(values)) => field.values = Some(values),
                _ => {}
            }
            Ok(())
        })?;
        Ok(field)
    }

    fn numbers(&self, path: &'a Path) -> Result<Vec<f64>> {
        let mut values = self.values.unwrap_or(Bytes::of(path, &[]));
        let (count, requested) = (values.left().len() / 8, self.nx.saturating_mul(self.ny));
        if count != requested {
            let found = format!("{count} numbers in a field of {} x {} points", self.nx, self.ny);
            return Err(Error::format(path, found, format!("{requested} (the file is damaged)")));
        }
        values.field([self.nx, self.ny], F64)
    }
}

fn unit_of<'a>(path: &'a Path, body: Bytes<'a>) -> Result<String> {
    let mut unit = String::new();
    components(path, body, |name, value| {
        if let ("unitstr", GwyValue::Text(text)) = (name.as_str(), value) {
            unit = text.trim().to_string();
        }
        Ok(())
    })?;
    Ok(unit)
}

/// Whether a unit is one of length. `A` is the ampere here, not the ångström.
fn is_length(unit: &str) -> bool {
    unit != "A" && metres_per(unit).is_some()
}

/// A channel whose data were found: number, title, field, mask.
struct GwyChannel<'a> {
    number: u32,
    title: String,
    field: GwyField<'a>,
    mask: Option<Bytes<'a>>,
}

impl GwyChannel<'_> {
    fn words(&self) -> String {
        format!("{} {:?}", self.number, self.title)
    }
}

/// Reads a channel of a Gwyddion file (`.gwy`): the one that [`ImportOptions::dataset`] names by title or number, otherwise the
/// only one whose values have a unit of length, or without such a one the only one without a unit. Masked points count as not measured.
pub(super) fn read(path: &Path, options: ImportOptions) -> Result<ImportedFile> {
    let bytes = bytes::whole(path)?;
    let mut remainder = Bytes::of(path, &bytes);
    remainder.take(MAGIC.len(), "the name of the format")?;
    let (name, body) = object(path, &mut remainder)?;
    if name != "GwyContainer" {
        return Err(Error::format(path, format!("an object {name:?} at the start"), "a GwyContainer"));
    }
    let all = channels(path, body)?;
    let mut heights: Vec<&GwyChannel> = all.iter().filter(|c| is_length(&c.field.unit_z)).collect();
    if heights.is_empty() {
        // Their unit is given with the file.
        heights = all.iter().filter(|c| c.field.unit_z.is_empty()).collect();
    }
    let chosen = choose(path, &all, &heights, options.dataset)?;
    let field = &chosen.field;
    let mut values = field.numbers(path)?;
    if let Some(mask) = chosen.mask {
        let mask = GwyField::of(path, mask)?;
        if (mask.nx, mask.ny) != (field.nx, field.ny) {
            let found = format!("a mask of {} x {} points", mask.nx, mask.ny);
            return Err(Error::format(path, found, format!("{} x {}, as its channel", field.nx, field.ny)));
        }
        let masked = mask.numbers(path)?;
        values.iter_mut().zip(masked).filter(|(_, m)| *m > MASKED).for_each(|(h, _)| *h = f64::NAN);
    }
    let map = HeightMap::with_missing(&path.display().to_string(), field.nx, field.ny, values)?;
    let extent = match is_length(&field.unit_xy) {
        // Gwyddion ignores the sign of an extent.
        true => Some(DeclaredExtent {
            x: bytes::positive(path, "xreal", field.x.abs())?,
            y: bytes::positive(path, "yreal", field.y.abs())?,
            unit: Some(field.unit_xy.clone()),
        }),
        false => None,
    };
    let declared = Declared {
        unit: Some(field.unit_z.clone()).filter(|unit| !unit.is_empty()),
        extent,
        channel: Some(chosen.title.clone()),
        channels: heights.iter().map(|c| c.title.clone()).collect(),
        ..Declared::default()
    };
    Ok(ImportedFile::map(map, declared, format!("Gwyddion channel {} [ny, nx]", chosen.words())))
}

/// Channels with data, in the order of their numbers.
fn channels<'a>(path: &'a Path, body: Bytes<'a>) -> Result<Vec<GwyChannel<'a>>> {
    let (mut titles, mut fields, mut masks) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    components(path, body, |name, value| {
        let key = name.strip_prefix('/').and_then(|n| n.split_once('/'));
        let Some((Ok(number), part)) = key.map(|(n, part)| (n.parse(), part)) else { return Ok(()) };
        match (part, value) {
            ("data", GwyValue::Object(body)) => drop(fields.insert(number, body)),
            ("mask", GwyValue::Object(body)) => drop(masks.insert(number, body)),
            ("data/title", GwyValue::Text(title)) => drop(titles.insert(number, title)),
            _ => {}
        }
        Ok(())
    })?;
    let channel = |(number, body)| {
        let (title, mask) = (titles.remove(&number).unwrap_or_default(), masks.remove(&number));
        Ok(GwyChannel { number, title, field: GwyField::of(path, body)?, mask })
    };
    fields.into_iter().map(channel).collect()
}

/// Selects a channel: by title, by number, or the only one of `heights`.
fn choose<'a, 'b>(
    path: &Path,
    all: &'b [GwyChannel<'a>],
    heights: &[&'b GwyChannel<'a>],
    requested: Option<&str>,
) -> Result<&'b GwyChannel<'a>> {
    let list = heights.iter().map(|c| c.words()).collect::<Vec<_>>().join(", ");
    let Some(requested) = requested else {
        return match heights {
            [only] => Ok(only),
            [] => {
                let list: Vec<_> = all.iter().map(|c| format!("{} in {:?}", c.words(), c.field.unit_z)).collect();
                let found = format!("no channel with a unit of length ({})", list.join(", "));
                Err(Error::format(path, found, "a channel of heights, in m"))
            }
            _ => {
                let found = format!("{} channels of heights ({list})", heights.len());
                Err(Error::format(path, found, "the title or number of one of them as --dataset (surface.dataset)"))
            }
        };
    };
    let titled: Vec<&GwyChannel> = all.iter().filter(|c| c.title == requested).collect();
    let numbered = || all.iter().find(|c| requested.parse() == Ok(c.number));
    let chosen = match titled[..] {
        [only] => only,
        [] => numbered().ok_or_else(|| Error::format(path, format!("no channel {requested:?}"), &list))?,
        _ => {
            let found = format!("{} channels with the title {requested:?}", titled.len());
            return Err(Error::format(path, found, format!("the number of one of them: {list}")));
        }
    };
    if !is_length(&chosen.field.unit_z) && !chosen.field.unit_z.is_empty() {
        let found = format!("channel {} in {:?}", chosen.words(), chosen.field.unit_z);
        return Err(Error::format(path, found, format!("a channel with a unit of length: {list}")));
    }
    Ok(chosen)
}
