use super::variable::{Attribute, Variable};

/// Alignment of the data of variables, bytes.
const ALIGNMENT: u64 = 8;
const SUPERBLOCK: u64 = 96;
const UNDEFINED: u64 = u64::MAX;
/// Minimum size of a global heap in the reference library, bytes.
const SMALLEST_HEAP: usize = 4096;

/// Maximum number of characters of an attribute: at most four bytes each, and a header message has at most 65 535
/// bytes.
const LONGEST_TEXT: usize = 16_000;

/// Message types of an object header.
const DATASPACE: u16 = 0x01;
const LINK_INFO: u16 = 0x02;
const DATATYPE: u16 = 0x03;
const FILL_VALUE: u16 = 0x05;
const LINK: u16 = 0x06;
const LAYOUT: u16 = 0x08;
const GROUP_INFO: u16 = 0x0A;
const ATTRIBUTE: u16 = 0x0C;

/// Encoded datatypes.
const F64: [u8; 20] = [0x11, 0x20, 0x3F, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 0x03, 0, 0];
const U8: [u8; 12] = [0x10, 0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0];
const I32: [u8; 12] = [0x10, 0x08, 0, 0, 4, 0, 0, 0, 0, 0, 32, 0];
const REFERENCE: [u8; 8] = [0x17, 0, 0, 0, 8, 0, 0, 0];

pub(super) fn padding(bytes: u64) -> usize {
    (bytes.next_multiple_of(ALIGNMENT) - bytes) as usize
}

/// Everything before the data: superblock, headers of the group and of all variables, and the heap with the
/// references from variables to their dimensions. Sizes do not depend on addresses, so the headers are built twice:
/// first to compute the addresses, then with them.
pub(super) fn head(attributes: &[(String, Attribute)], variables: &[Variable], shapes: &[Vec<u64>]) -> Vec<u8> {
    let lost = FileAddresses { headers: vec![0; variables.len()], data: vec![0; variables.len()], heap: 0 };
    let group_size = group(attributes, variables, &lost).len() as u64;
    let mut offset = SUPERBLOCK + group_size;
    let mut place = |bytes: u64| {
        let here = offset;
        offset = (offset + bytes).next_multiple_of(ALIGNMENT);
        here
    };
    let headers = (0..variables.len()).map(|i| place(header(variables, shapes, i, &lost).len() as u64)).collect();
    let heap_at = place(heap(variables, &lost).len() as u64);
    let bytes = |i: usize| shapes[i].iter().product::<u64>() * variables[i].data.bytes_each() as u64;
    let data = (0..variables.len()).map(|i| place(bytes(i))).collect();
    let places = FileAddresses { headers, data, heap: heap_at };
    let mut out = superblock(offset);
    out.extend(group(attributes, variables, &places));
    (0..variables.len()).for_each(|i| out.extend(header(variables, shapes, i, &places)));
    out.extend(heap(variables, &places));
    debug_assert_eq!(places.data.first().map_or(offset, |d| *d), out.len() as u64);
    out
}

/// Addresses in the file.
struct FileAddresses {
    headers: Vec<u64>,
    data: Vec<u64>,
    heap: u64,
}

fn superblock(end: u64) -> Vec<u8> {
    let mut out = b"\x89HDF\r\n\x1a\n".to_vec();
    // Versions, sizes of offsets and lengths, and the parameters of group B-trees, which this file does not use.
    out.extend([0, 0, 0, 0, 0, 8, 8, 0, 4, 0, 16, 0, 0, 0, 0, 0]);
    [0, UNDEFINED, end, UNDEFINED].iter().for_each(|v| out.extend(v.to_le_bytes()));
    // Symbol table entry of the root group, whose header follows.
    [0, SUPERBLOCK, 0, 0, 0].iter().for_each(|v: &u64| out.extend(v.to_le_bytes()));
    out
}

/// Object header, version 1, with these messages.
fn object(messages: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, message) in messages {
        let padded = message.len().next_multiple_of(8);
        body.extend(kind.to_le_bytes());
        body.extend((padded as u16).to_le_bytes());
        body.extend([0; 4]);
        body.extend(message);
        body.resize(body.len() + padded - message.len(), 0);
    }
    let mut out = vec![1, 0];
    out.extend((messages.len() as u16).to_le_bytes());
    out.extend(1_u32.to_le_bytes());
    out.extend((body.len() as u32).to_le_bytes());
    out.extend([0; 4]);
    out.extend(body);
    out
}

/// The root group: attributes of the file and links to its variables.
fn group(attributes: &[(String, Attribute)], variables: &[Variable], places: &FileAddresses) -> Vec<u8> {
    let mut info = vec![0, 0];
    info.extend(UNDEFINED.to_le_bytes());
    info.extend(UNDEFINED.to_le_bytes());
    let mut messages = vec![(LINK_INFO, info), (GROUP_INFO, vec![0, 0])];
    for (variable, address) in variables.iter().zip(&places.headers) {
        // Hard link with a name length of two bytes.
        let mut link = vec![1, 0x01];
        link.extend((variable.name.len() as u16).to_le_bytes());
        link.extend(variable.name.as_bytes());
        link.extend(address.to_le_bytes());
        messages.push((LINK, link));
    }
    messages.extend(attributes.iter().map(|(name, value)| (ATTRIBUTE, attribute(name, value))));
    object(&messages)
}

/// Object header of one variable.
fn header(variables: &[Variable], shapes: &[Vec<u64>], i: usize, places: &FileAddresses) -> Vec<u8> {
    let (variable, shape) = (&variables[i], &shapes[i]);
    let each = variable.data.bytes_each();
    let mut layout = vec![3, 1];
    layout.extend(places.data[i].to_le_bytes());
    layout.extend((shape.iter().product::<u64>() * each as u64).to_le_bytes());
    let mut messages = vec![
        (DATASPACE, dataspace(shape)),
        (DATATYPE, if each == 8 { F64.to_vec() } else { U8.to_vec() }),
        // Version 2, space allocated early, fill value written only if defined; it is not defined.
        (FILL_VALUE, vec![2, 1, 2, 0]),
        (LAYOUT, layout),
    ];
    messages.extend(variable.attributes.iter().map(|(name, value)| (ATTRIBUTE, attribute(name, value))));
    if is_coordinate(variable) {
        let number = coordinates(variables).position(|k| k == i).expect("a coordinate");
        messages.push((ATTRIBUTE, attribute("CLASS", &Attribute::Text("DIMENSION_SCALE".into()))));
        messages.push((ATTRIBUTE, attribute("NAME", &Attribute::Text(variable.name.clone()))));
        messages.push((ATTRIBUTE, raw_attribute("_Netcdf4Dimid", &I32, &[], &(number as i32).to_le_bytes())));
        messages.extend(users(variables, i, places));
    } else if !variable.dimensions.is_empty() {
        let previous: usize = variables[..i].iter().map(scales).sum();
        let mut list = Vec::new();
        for k in 0..variable.dimensions.len() {
            list.extend(1_u32.to_le_bytes());
            list.extend(places.heap.to_le_bytes());
            list.extend(((previous + k + 1) as u32).to_le_bytes());
        }
        // Variable-length sequences of references.
        let kind = [&[0x19, 0, 0, 0, 16, 0, 0, 0][..], &REFERENCE].concat();
        messages.push((ATTRIBUTE, raw_attribute("DIMENSION_LIST", &kind, &[variable.dimensions.len() as u64], &list)));
    }
    object(&messages)
}

/// Attribute REFERENCE_LIST of a dimension: the variables that use it.
fn users(variables: &[Variable], scale: usize, places: &FileAddresses) -> Option<(u16, Vec<u8>)> {
    let mut list = Vec::new();
    let mut count = 0;
    for (variable, address) in variables.iter().zip(&places.headers).filter(|(v, _)| !is_coordinate(v)) {
        for (axis, _) in variable.dimensions.iter().enumerate().filter(|(_, d)| **d == variables[scale].name) {
            list.extend(address.to_le_bytes());
            list.extend((axis as u32).to_le_bytes());
            list.extend([0; 4]);
            count += 1;
        }
    }
    // Compound type of a reference and an integer, in the memory layout of the reference library.
    let mut kind = vec![0x36, 2, 0, 0, 16, 0, 0, 0];
    kind.extend(b"dataset\0\0");
    kind.extend(REFERENCE);
    kind.extend(b"dimension\0\x08");
    kind.extend(I32);
    (count > 0).then(|| (ATTRIBUTE, raw_attribute("REFERENCE_LIST", &kind, &[count], &list)))
}

fn is_coordinate(variable: &Variable) -> bool {
    variable.dimensions == [variable.name.as_str()]
}

fn coordinates(variables: &[Variable]) -> impl Iterator<Item = usize> {
    (0..variables.len()).filter(|&i| is_coordinate(&variables[i]))
}

/// Number of references of a variable to its dimensions.
fn scales(variable: &Variable) -> usize {
    if is_coordinate(variable) { 0 } else { variable.dimensions.len() }
}

/// Global heap: one reference per dimension of every variable, numbered from 1.
fn heap(variables: &[Variable], places: &FileAddresses) -> Vec<u8> {
    let mut objects = Vec::new();
    let mut index = 0_u16;
    for variable in variables.iter().filter(|v| scales(v) > 0) {
        for dimension in &variable.dimensions {
            let scale =
                coordinates(variables).find(|&k| variables[k].name == *dimension).expect("checked with the shapes");
            index += 1;
            objects.extend(index.to_le_bytes());
            objects.extend([1, 0, 0, 0, 0, 0]);
            objects.extend(8_u64.to_le_bytes());
            objects.extend(places.headers[scale].to_le_bytes());
        }
    }
    let size = (16 + objects.len() + 16).max(SMALLEST_HEAP);
    let mut out = b"GCOL\x01\0\0\0".to_vec();
    out.extend((size as u64).to_le_bytes());
    out.extend(objects);
    // Object 0 is the free space.
    let free = (size - out.len()) as u64;
    out.extend([0; 8]);
    out.extend(free.to_le_bytes());
    out.resize(size, 0);
    out
}

fn dataspace(shape: &[u64]) -> Vec<u8> {
    let mut out = vec![1, shape.len() as u8, 0, 0, 0, 0, 0, 0];
    shape.iter().for_each(|n| out.extend(n.to_le_bytes()));
    out
}

fn attribute(name: &str, value: &Attribute) -> Vec<u8> {
    match value {
        Attribute::Number(number) => raw_attribute(name, &F64, &[], &number.to_le_bytes()),
        Attribute::Text(text) => {
            // UTF-8, zero-terminated; longer texts are truncated and end in "…".
            let text = match text.char_indices().nth(LONGEST_TEXT) {
                Some((end, _)) => format!("{} …", &text[..end]),
                None => text.clone(),
            };
            let bytes = [text.as_bytes(), &[0]].concat();
            let mut kind = vec![0x13, 0x10, 0, 0];
            kind.extend((bytes.len() as u32).to_le_bytes());
            raw_attribute(name, &kind, &[], &bytes)
        }
    }
}

fn raw_attribute(name: &str, kind: &[u8], shape: &[u64], value: &[u8]) -> Vec<u8> {
    let space = dataspace(shape);
    let mut out = vec![1, 0];
    for length in [name.len() + 1, kind.len(), space.len()] {
        out.extend((length as u16).to_le_bytes());
    }
    for part in [&[name.as_bytes(), &[0]].concat()[..], kind, &space] {
        out.extend(part);
        out.resize(out.len().next_multiple_of(8), 0);
    }
    out.extend(value);
    out
}
