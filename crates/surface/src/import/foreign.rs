//! Files that are recognised and not read, with the way to convert them.

/// Accepted formats of height files.
pub(super) const KINDS: &str = "text (a matrix, lines of x y h, or qX qY Re Im), .npy, .npz, HDF5, NetCDF, x3p, SDF, .sur or .gwy; Gwyddion \
                                (File, Save as .gwy) and SurfaceTopography (to_netcdf) convert files of instruments";

const IMAGE: &str = "heights in a table or in a file of the instrument: the grey levels of an image are no heights";
const MATLAB: &str = "save('map.mat', 'h', '-v7.3'), or writematrix(h, 'map.txt')";

/// First bytes, kind of file, and what is accepted instead.
const KNOWN: [(&[u8], &str, &str); 15] = [
    (b"Wyko ASCII", "Wyko ASCII", KINDS),
    (b"\x01\x00Directory", "Wyko OPD", KINDS),
    (b"\\*File list", "Nanoscope", KINDS),
    (b"\x88\x1b\x03", "Zygo MetroPro", KINDS),
    (b"VK4_", "Keyence VK4", KINDS),
    (b"VK6", "Keyence VK6", KINDS),
    (b"AliconaImaging", "Alicona", KINDS),
    (b"\x89PNG", "a PNG image", IMAGE),
    (b"II*\0", "a TIFF image", IMAGE),
    (b"MM\0*", "a TIFF image", IMAGE),
    (b"\xff\xd8\xff", "a JPEG image", IMAGE),
    (b"%PDF-", "a PDF document", KINDS),
    (b"\xd0\xcf\x11\xe0", "a workbook or document of Office", "its table, saved as CSV"),
    (b"MATLAB 5.0 MAT", "a MATLAB file before version 7.3", MATLAB),
    (b"GIF8", "a GIF image", IMAGE),
];

/// What a file is and what is accepted instead, by its first bytes.
pub(super) fn known(start: &[u8]) -> Option<(&'static str, &'static str)> {
    KNOWN.iter().find(|(magic, ..)| start.starts_with(magic)).map(|(_, kind, accepted)| (*kind, *accepted))
}

/// Likewise of an archive that is no `.npz` and no x3p, by the names of its files.
pub(super) fn archive<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<(&'static str, &'static str)> {
    names.find_map(|name| match name {
        "[Content_Types].xml" => Some(("a workbook or document of Office", "its table, saved as CSV")),
        "index.xml" => Some(("Sensofar PLUX, or another archive of an instrument", KINDS)),
        _ => None,
    })
}
