//! Variables of a NetCDF file: names, dimensions, attributes and data sources.

use std::path::PathBuf;

/// Metadata of a file or a variable.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    Text(String),
    Number(f64),
}

/// Data source of a variable.
#[derive(Debug, Clone)]
pub enum VariableData {
    Numbers(Vec<f64>),
    /// Stack of `[ny, nx]` maps times a factor.
    Scaled(Vec<PathBuf>, f64),
    /// 1 where a map is at most zero, otherwise 0; as bytes.
    AtMostZero(Vec<PathBuf>),
    /// Maps of flags; as bytes.
    Flags(Vec<PathBuf>),
}

impl VariableData {
    pub(super) fn bytes_each(&self) -> usize {
        match self {
            VariableData::Numbers(_) | VariableData::Scaled(..) => 8,
            VariableData::AtMostZero(_) | VariableData::Flags(_) => 1,
        }
    }
}

/// An array in row-major order. A one-dimensional variable with the name of its dimension is the coordinate of that
/// dimension.
#[derive(Debug, Clone)]
pub struct Variable {
    pub name: String,
    pub dimensions: Vec<String>,
    pub data: VariableData,
    pub attributes: Vec<(String, Attribute)>,
}

impl Variable {
    /// A variable with its unit ("1" for none) and a description.
    pub fn new(name: &str, dimensions: &[&str], data: VariableData, units: &str, long_name: &str) -> Self {
        let text = |key: &str, value: &str| (key.to_string(), Attribute::Text(value.to_string()));
        let dimensions = dimensions.iter().map(|d| d.to_string()).collect();
        let attributes = vec![text("units", units), text("long_name", long_name)];
        Variable { name: name.into(), dimensions, data, attributes }
    }

    pub fn with(mut self, key: &str, value: Attribute) -> Self {
        self.attributes.push((key.into(), value));
        self
    }

    /// Adds a prefix to the name of the variable and to those of its dimensions that are not `shared`.
    pub fn prefixed(mut self, prefix: &str, shared: &[&str]) -> Self {
        self.name.insert_str(0, prefix);
        self.dimensions.iter_mut().filter(|d| !shared.contains(&d.as_str())).for_each(|d| d.insert_str(0, prefix));
        self
    }
}

/// Coordinate with `n` consecutive integers from `first` on.
pub fn counter(name: &str, first: usize, n: usize, long_name: &str) -> Variable {
    let numbers = (first..first + n).map(|i| i as f64).collect();
    Variable::new(name, &[name], VariableData::Numbers(numbers), "1", long_name)
}
