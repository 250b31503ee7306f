//! Files that are recognised and not read, with the way to convert them.

/// Accepted formats of height files.
pub(super) const KINDS: &str = "text (a matrix, lines of x y h, or qX qY Re Im), .npy, .npz, HDF5, NetCDF, x3p, SDF, .sur or .gwy; of an \
                                instrument --via-python (surface.via_python), or what Gwyddion saves as .gwy";

/// The way for a file of an instrument that SurfaceTopography reads.
const CONVERT: &str = "--via-python (surface.via_python), or NetCDF: pip install \"asperity[files]\"; python -m asperity.convert FILE \
                       out.nc; or what Gwyddion saves as .gwy";

/// The same for a profile.
const PROFILE: &str = "--via-python --profile (surface.via_python, surface.profile), or NetCDF: pip install \"asperity[files]\"; python -m \
                       asperity.convert FILE out.nc --profile; or what Gwyddion saves as .gwy";

/// The way for one that it does not read.
const GWYDDION: &str = "a file that Gwyddion saves (File, Save as .gwy)";

const IMAGE: &str = "heights in a table or in a file of the instrument: the grey levels of an image are no heights";
const TIFF: &str = "of an instrument (JPK, Park, Olympus): --via-python (surface.via_python), or pip install \"asperity[files]\"; python -m \
                    asperity.convert FILE out.nc; or what Gwyddion saves as .gwy; of an image: heights in a table, as grey levels are none";
const OLE: &str = "of an instrument (Mountains, Olympus): --via-python (surface.via_python), or pip install \"asperity[files]\"; python -m \
                   asperity.convert FILE out.nc; or what Gwyddion saves as .gwy; of Office: its table, saved as CSV";
const MATLAB: &str = "save('map.mat', 'h', '-v7.3'), writematrix(h, 'map.txt'), or --via-python (surface.via_python)";
const TABLE: &str = "its table, saved as CSV";
const POINTS: &str = "a map of heights on an even grid, or lines of x y h";

/// First bytes, kind of file, and what is accepted instead.
const KNOWN: &[(&[u8], &str, &str)] = &[
    (b"Wyko ASCII", "Wyko ASCII", GWYDDION),
    (b"\x01\x00Directory", "Wyko OPD", CONVERT),
    (b"VCA DATA", "Bruker OPDx", CONVERT),
    (b"\\*File list", "Nanoscope", CONVERT),
    (b"\\*EC File list", "Nanoscope (electrochemistry)", CONVERT),
    (b"\\*Force file list", "a force curve of Nanoscope", GWYDDION),
    (b"?*File list", "Nanoscope of another program", GWYDDION),
    (b"*File list", "Nanoscope of another program", GWYDDION),
    (b"\x88\x1b\x03", "Zygo MetroPro", CONVERT),
    (b"Zygo ASCII", "Zygo ASCII", GWYDDION),
    (b"Scan Parameters\r\r\nScan Type", "a profile of Dektak", PROFILE),
    (b"Scan Parameters\r\nScan Type", "a profile of Dektak", PROFILE),
    (b"Scan Parameters\nScan Type", "a profile of Dektak", PROFILE),
    (b"VK3", "Keyence VK3", CONVERT),
    (b"VK4", "Keyence VK4", CONVERT),
    (b"VK6", "Keyence VK6", CONVERT),
    (b"VK7", "Keyence VK7", CONVERT),
    (b"KPK0", "Keyence ZON", CONVERT),
    (b"Alicona", "Alicona", CONVERT),
    (b"WSxM file", "WSxM", CONVERT),
    (b"[DataSet]", "Nanosurf", CONVERT),
    (b"NSFN", "Nanosurf NSF", GWYDDION),
    (b"p\0\0\0", "Leica LIF", GWYDDION),
    (b"\x01\xb0\x93\xff", "NT-MDT", CONVERT),
    (b":NANONIS_VERSION:", "Nanonis", GWYDDION),
    (b"ONTMATRX", "Omicron Matrix", GWYDDION),
    (b"FLAT0100", "Omicron flat file", GWYDDION),
    (b"fileType      Image", "Agilent (Molecular Imaging)", CONVERT),
    (b"[Paramco", "Createc", GWYDDION),
    (b"fileformat = bcr", "BCR of Image Metrology", CONVERT),
    (b"f\0i\0l\0e\0f\0o\0r\0m\0a\0t\0 \0=\0 \0b\0c\0r\0", "BCR of Image Metrology", CONVERT),
    (b"\xff\xfef\0i\0l\0e\0f\0o\0r\0m\0a\0t\0 \0=\0 \0b\0c\0r\0", "BCR of Image Metrology", CONVERT),
    (b"Binary TrueMap Data File", "TrueMap", CONVERT),
    (b"FRTM_GLIDERV", "FRT MicroProf", CONVERT),
    (b"OLYMPUSRAWFORMAT", "Olympus OIR", CONVERT),
    (b"IGOR", "Igor text", GWYDDION),
    (b"ISO/TC 201 SPM", "ISO 28600", GWYDDION),
    (b"\x89PNG", "a PNG image", IMAGE),
    (b"II*\0", "a TIFF file", TIFF),
    (b"MM\0*", "a TIFF file", TIFF),
    (b"II+\0", "a TIFF file", TIFF),
    (b"MM\0+", "a TIFF file", TIFF),
    (b"\xff\xd8\xff", "a JPEG image", IMAGE),
    (b"GIF8", "a GIF image", IMAGE),
    (b"%PDF-", "a PDF document", KINDS),
    (b"\xd0\xcf\x11\xe0", "an OLE file", OLE),
    (b"MATLAB 5.0 MAT", "a MATLAB file before version 7.3", MATLAB),
    (b"PAR1", "a Parquet table", TABLE),
    (b"ARROW1", "an Arrow table", TABLE),
    (b"ply\n", "a PLY mesh", POINTS),
    (b"ply\r\n", "a PLY mesh", POINTS),
    (b"solid ", "an STL mesh", POINTS),
    (b"BZh", "packed by bzip2", "the file that bunzip2 unpacks"),
    (b"\xfd7zXZ\0", "packed by xz", "the file that unxz unpacks"),
    (b"\x28\xb5\x2f\xfd", "packed by zstd", "the file that unzstd unpacks"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "a file that 7z x unpacks"),
    (b"Rar!", "a RAR archive", "a file that unrar x unpacks"),
];

/// Bytes of an Igor binary wave (version 2, and version 5) whose sum as 16-bit words is 0.
const IGOR_HEADERS: [(u16, usize); 2] = [(2, 126), (5, 384)];

/// Whether SurfaceTopography may read a file of which this is accepted instead.
pub(super) fn is_convertible(accepted: &str) -> bool {
    [CONVERT, PROFILE, TIFF, OLE, MATLAB].contains(&accepted)
}

/// Kinds of files that SurfaceTopography does not read either, with what is accepted instead.
pub(super) fn not_converted() -> impl Iterator<Item = (&'static str, &'static str)> {
    KNOWN.iter().map(|(_, kind, accepted)| (*kind, *accepted)).filter(|(_, accepted)| !is_convertible(accepted))
}

/// What a file is and what is accepted instead, by its first bytes.
pub(super) fn known(start: &[u8]) -> Option<(&'static str, &'static str)> {
    if start.get(257..262) == Some(b"ustar") {
        return Some(("a tar archive", "a file that tar xf unpacks"));
    }
    if is_igor(start) {
        return Some(("an Igor wave (Asylum)", CONVERT));
    }
    KNOWN.iter().find(|(magic, ..)| start.starts_with(magic)).map(|(_, kind, accepted)| (*kind, *accepted))
}

fn is_igor(start: &[u8]) -> bool {
    [u16::from_le_bytes, u16::from_be_bytes].into_iter().any(|word: fn([u8; 2]) -> u16| {
        let sum = |bytes: &[u8]| bytes.as_chunks().0.iter().fold(0_u16, |sum, b| sum.wrapping_add(word(*b)));
        let version = start.first_chunk().map_or(0, |b| word(*b));
        let header = IGOR_HEADERS.iter().find(|(of, _)| *of == version).and_then(|(_, bytes)| start.get(..*bytes));
        header.is_some_and(|bytes| sum(bytes) == 0)
    })
}

/// Likewise of an archive that is no `.npz` and no x3p, by the names of its files.
pub(super) fn archive<'a>(names: impl Iterator<Item = &'a str>) -> Option<(&'static str, &'static str)> {
    let names: Vec<&str> = names.collect();
    let has = |wanted: &str| names.iter().any(|n| n.rsplit('/').next() == Some(wanted));
    Some(if has("[Content_Types].xml") {
        ("a workbook or document of Office", TABLE)
    } else if has("index.json") || has("meta.yml") {
        ("a container of contact.engineering", CONVERT)
    } else if has("index.xml") {
        ("Sensofar PLUX, or another archive of an instrument", CONVERT)
    } else if has("header.properties") {
        ("force curves of JPK", GWYDDION)
    } else {
        return None;
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_instruments_are_named_with_a_way() {
        for (start, kind) in [
            (&b"\\*File list\r\n\\Version: 0x09400202"[..], "Nanoscope"),
            (b"\\*EC File list\r\n", "Nanoscope"),
            (b"\xd0\xcf\x11\xe0\xa1\xb1", "OLE"),
            (b"II*\0\x08\0\0\0", "TIFF"),
            (b"WSxM file copyright UAM\r\n", "WSxM"),
            (b"[DataSet]\r\nVersion=2\r\n", "Nanosurf"),
            (b"VK7\0", "Keyence"),
        ] {
            let (found, accepted) = known(start).expect(kind);
            assert!(found.contains(kind) && accepted.contains(".gwy") && is_convertible(accepted), "{found}");
            assert!(
                accepted.contains("--via-python") && accepted.contains("asperity.convert FILE out.nc"),
                "{accepted}"
            );
        }
        // A wave of version 5 whose checksum fits, in both byte orders, and one whose does not.
        let mut wave = vec![0; 384];
        (wave[0], wave[2], wave[3]) = (5, 0xFB, 0xFF);
        assert!(known(&wave).is_some_and(|(kind, _)| kind.contains("Igor")));
        wave.as_chunks_mut::<2>().0.iter_mut().for_each(|b| b.reverse());
        assert!(known(&wave).is_some_and(|(kind, _)| kind.contains("Igor")));
        wave[100] = 1;
        assert_eq!(known(&wave), None);
        let name = |names: &[&'static str]| archive(names.iter().copied()).map(|(kind, _)| kind);
        assert!(name(&["index.json", "a.nc"]).is_some_and(|k| k.contains("contact.engineering")));
        assert!(name(&["x/index.xml"]).is_some_and(|k| k.contains("PLUX")) && name(&["map.txt"]).is_none());
    }
}
