//! LAMMPS as a shared library, opened at run time: instances that run scripts and call back for the forces of a `fix external`.
//!
//! The functions are those of LAMMPS's C library interface (`library.h`); Debian's build of 29 Sep 2021 has all of them.

use std::ffi::{CStr, CString, c_char, c_double, c_int, c_void};
use std::path::Path;

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};

type Handle = *mut c_void;
type Callback = extern "C" fn(*mut c_void, i64, c_int, *mut c_int, *mut *mut c_double, *mut *mut c_double);

/// Longest message that LAMMPS returns.
const MESSAGE_BYTES: usize = 2048;

/// Forces on the atoms with the ids 1 to n at their positions (Å): fills the second argument (eV/Å) and returns the energy (eV).
pub type BoundaryForces = Box<dyn FnMut(&[[f64; 3]], &mut [[f64; 3]]) -> f64>;

/// A vector that each atom has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtomProperty {
    Position,
    Force,
}

impl AtomProperty {
    fn name(self) -> &'static CStr {
        match self {
            AtomProperty::Position => c"x",
            AtomProperty::Force => c"f",
        }
    }
}

macro_rules! functions {
    ($($name:ident: fn($($arg:ty),*) $(-> $ret:ty)?;)*) => {
        /// Functions of the library.
        #[derive(Clone, Copy)]
        struct Functions { $($name: unsafe extern "C" fn($($arg),*) $(-> $ret)?,)* }

        impl Functions {
            /// # Safety
            /// The library must be LAMMPS.
            unsafe fn of(library: &Library) -> Result<Self, String> {
                Ok(Functions { $($name: {
                    // SAFETY: the types are those of library.h.
                    let symbol = unsafe { library.get(stringify!($name).as_bytes()) };
                    *symbol.map_err(|_| format!("it lacks the function {}", stringify!($name)))?
                },)* })
            }
        }
    };
}

functions! {
    lammps_open_no_mpi: fn(c_int, *mut *mut c_char, *mut Handle) -> Handle;
    lammps_close: fn(Handle);
    lammps_mpi_finalize: fn();
    lammps_version: fn(Handle) -> c_int;
    lammps_extract_setting: fn(Handle, *const c_char) -> c_int;
    lammps_command: fn(Handle, *const c_char) -> *mut c_char;
    lammps_file: fn(Handle, *const c_char);
    lammps_config_has_exceptions: fn() -> c_int;
    lammps_has_error: fn(Handle) -> c_int;
    lammps_get_last_error_message: fn(Handle, *mut c_char, c_int) -> c_int;
    lammps_extract_variable: fn(Handle, *const c_char, *const c_char) -> *mut c_void;
    lammps_free: fn(*mut c_void);
    lammps_get_natoms: fn(Handle) -> c_double;
    lammps_gather_atoms: fn(Handle, *const c_char, c_int, c_int, *mut c_void);
    lammps_scatter_atoms: fn(Handle, *const c_char, c_int, c_int, *mut c_void);
    lammps_extract_global: fn(Handle, *const c_char) -> *mut c_void;
    lammps_gather_atoms_subset: fn(Handle, *const c_char, c_int, c_int, c_int, *mut c_int, *mut c_void);
    lammps_set_fix_external_callback: fn(Handle, *const c_char, Callback, *mut c_void);
    lammps_fix_external_set_energy_global: fn(Handle, *const c_char, c_double);
    lammps_fix_external_set_vector_length: fn(Handle, *const c_char, c_int);
    lammps_fix_external_set_vector: fn(Handle, *const c_char, c_int, c_double);
}

/// Whether a library is a LAMMPS that can be used; LAMMPS is not started.
///
/// # Errors
/// As [`LammpsInstance::open`].
pub fn check(library: &Path) -> Result<(), String> {
    loaded(library).map(|_| ())
}

/// The library, which is never closed because MPI registers code of it to run at exit, and its functions.
fn loaded(library: &Path) -> Result<(std::mem::ManuallyDrop<Library>, Functions), String> {
    // The plugins of Open MPI need its symbols: RTLD_GLOBAL.
    // SAFETY: initialisers of LAMMPS and MPI have no requirements.
    let opened = unsafe { Library::open(Some(library), RTLD_NOW | RTLD_GLOBAL) }.map_err(|e| e.to_string())?;
    let opened = std::mem::ManuallyDrop::new(opened);
    // SAFETY: a library with these names is LAMMPS.
    let functions = unsafe { Functions::of(&opened)? };
    for (name, bytes) in [(c"bigint", 8), (c"tagint", 4)] {
        // SAFETY: the size of a type is known without an instance.
        let setting = unsafe { (functions.lammps_extract_setting)(std::ptr::null_mut(), name.as_ptr()) };
        if setting != bytes {
            let name = name.to_string_lossy();
            return Err(format!(
                "its {name} has {setting} bytes instead of {bytes}: another build is needed (-DLAMMPS_SMALLBIG)"
            ));
        }
    }
    Ok((opened, functions))
}

/// What the callback works with; it lives as long as the instance.
struct Boundary {
    functions: Functions,
    handle: Handle,
    fix: CString,
    several_ranks: bool,
    ids: Vec<c_int>,
    positions: Vec<[f64; 3]>,
    forces: Vec<[f64; 3]>,
    evaluate: BoundaryForces,
}

/// A running LAMMPS in this process. All ranks of an MPI run make the same calls.
pub struct LammpsInstance {
    functions: Functions,
    handle: Handle,
    /// From `Box::into_raw`; null without a boundary.
    boundary: *mut Boundary,
    _library: std::mem::ManuallyDrop<Library>,
}

impl LammpsInstance {
    /// Opens `library` (a path, or a name that the loader finds) and starts LAMMPS with the arguments of its command line, without the
    /// program's name. MPI is initialised where it is not yet.
    ///
    /// # Errors
    /// One line: the library is missing, is not LAMMPS, or has other sizes of integers.
    pub fn open(library: &Path, args: &[String]) -> Result<Self, String> {
        let (library, functions) = loaded(library)?;
        let arguments = std::iter::once("lmp".to_string()).chain(args.iter().cloned());
        let arguments: Vec<CString> = arguments.map(text).collect::<Result<_, _>>()?;
        let mut pointers: Vec<*mut c_char> = arguments.iter().map(|w| w.as_ptr().cast_mut()).collect();
        // SAFETY: as many pointers to strings as stated; LAMMPS copies them.
        let handle = unsafe {
            (functions.lammps_open_no_mpi)(pointers.len() as c_int, pointers.as_mut_ptr(), std::ptr::null_mut())
        };
        if handle.is_null() {
            return Err("LAMMPS did not start".into());
        }
        Ok(LammpsInstance { functions, handle, boundary: std::ptr::null_mut(), _library: library })
    }

    /// Date of the version, as 20210929.
    pub fn version(&self) -> i32 {
        // SAFETY: the handle is open.
        unsafe { (self.functions.lammps_version)(self.handle) }
    }

    /// MPI ranks of this run.
    pub fn ranks(&self) -> i32 {
        // SAFETY: the handle is open, the name ends with a zero.
        unsafe { (self.functions.lammps_extract_setting)(self.handle, c"world_size".as_ptr()) }
    }

    /// Executes one command of a script.
    ///
    /// # Errors
    /// LAMMPS's message. Builds without exceptions end the process instead, after they have printed it.
    pub fn command(&mut self, line: &str) -> Result<(), String> {
        let line = text(line.to_string())?;
        // SAFETY: the handle is open, the line ends with a zero.
        unsafe { (self.functions.lammps_command)(self.handle, line.as_ptr()) };
        self.check()
    }

    /// Executes a script.
    ///
    /// # Errors
    /// As [`LammpsInstance::command`].
    pub fn file(&mut self, name: &str) -> Result<(), String> {
        let name = text(name.to_string())?;
        // SAFETY: the handle is open, the name ends with a zero.
        unsafe { (self.functions.lammps_file)(self.handle, name.as_ptr()) };
        self.check()
    }

    fn check(&self) -> Result<(), String> {
        let f = &self.functions;
        // SAFETY: the handle is open; the buffer is as long as stated.
        unsafe {
            if (f.lammps_config_has_exceptions)() == 0 || (f.lammps_has_error)(self.handle) == 0 {
                return Ok(());
            }
            let mut message = [0 as c_char; MESSAGE_BYTES];
            (f.lammps_get_last_error_message)(self.handle, message.as_mut_ptr(), MESSAGE_BYTES as c_int - 1);
            Err(CStr::from_ptr(message.as_ptr()).to_string_lossy().trim().to_string())
        }
    }

    /// Load of the last step, and whether it was the last: the variables of the scripts of load steps.
    ///
    /// # Errors
    /// A variable does not exist.
    pub fn step_ended(&self) -> Result<(f64, bool), String> {
        // SAFETY: both have equal style, in `end_of_step.in` and in the scripts of the steps.
        unsafe { Ok((self.variable(c"load")?, self.variable(c"done")? != 0.0)) }
    }

    /// Value of an expression of an equal-style variable.
    ///
    /// # Errors
    /// As [`LammpsInstance::command`].
    pub fn value(&mut self, expression: &str) -> Result<f64, String> {
        self.command("variable host_value delete")?;
        self.command(&format!("variable host_value equal {expression}"))?;
        // SAFETY: it has equal style.
        let value = unsafe { self.variable(c"host_value") };
        self.check()?;
        value
    }

    /// Number of atoms.
    pub fn atoms(&self) -> usize {
        // SAFETY: the handle is open.
        unsafe { (self.functions.lammps_get_natoms)(self.handle) as usize }
    }

    /// Positions `x` (Å, wrapped or not) or forces `f` (eV/Å) of all atoms in the order of their ids, which are consecutive. All ranks must
    /// call it.
    ///
    /// # Errors
    /// As [`LammpsInstance::command`].
    pub fn gather(&mut self, property: AtomProperty, to: &mut Vec<[f64; 3]>) -> Result<(), String> {
        to.clear();
        to.resize(self.atoms(), [0.0; 3]);
        // SAFETY: three numbers for each atom, as stated.
        unsafe {
            (self.functions.lammps_gather_atoms)(self.handle, property.name().as_ptr(), 1, 3, to.as_mut_ptr().cast());
        }
        self.check()
    }

    /// Sets the positions of all atoms, in the order of their ids: each within its image of [`LammpsInstance::gather`].
    ///
    /// # Errors
    /// As [`LammpsInstance::command`], and another number of positions than atoms.
    pub fn scatter_positions(&mut self, from: &mut [[f64; 3]]) -> Result<(), String> {
        if from.len() != self.atoms() {
            return Err(format!("{} positions for {} atoms", from.len(), self.atoms()));
        }
        // SAFETY: three numbers for each atom; LAMMPS reads them only.
        unsafe {
            let x = AtomProperty::Position.name();
            (self.functions.lammps_scatter_atoms)(self.handle, x.as_ptr(), 1, 3, from.as_mut_ptr().cast());
        }
        self.check()
    }

    /// Lower and upper boundary of the box along z, Å.
    ///
    /// # Errors
    /// This LAMMPS does not know them.
    pub fn floor_and_ceiling(&self) -> Result<[f64; 2], String> {
        let read = |name: &CStr| {
            // SAFETY: the handle is open; these two are doubles.
            let value = unsafe { (self.functions.lammps_extract_global)(self.handle, name.as_ptr()) }.cast::<f64>();
            if value.is_null() {
                return Err(format!("there is no global {}", name.to_string_lossy()));
            }
            // SAFETY: it points to a number of the instance.
            Ok(unsafe { *value })
        };
        Ok([read(c"boxzlo")?, read(c"boxzhi")?])
    }

    /// Value of a variable.
    ///
    /// # Safety
    /// It has equal style, if it exists.
    unsafe fn variable(&self, name: &CStr) -> Result<f64, String> {
        let f = &self.functions;
        // SAFETY: the handle is open; an equal-style variable is returned as a double that the caller frees.
        unsafe {
            let value = (f.lammps_extract_variable)(self.handle, name.as_ptr(), std::ptr::null());
            if value.is_null() {
                return Err(format!("there is no variable {}", name.to_string_lossy()));
            }
            let number = *value.cast::<f64>();
            (f.lammps_free)(value);
            Ok(number)
        }
    }

    /// Sets the function that gives the forces of `fix external` with this id on the atoms with the ids 1 to `atoms`. A new fix, also one
    /// of the same id after `clear`, needs it anew. The vector of the fix is the total force of the other atoms on these, as a `fix
    /// setforce` has it.
    ///
    /// # Errors
    /// As [`LammpsInstance::command`], and a boundary that was not removed by `clear`.
    pub fn set_boundary(&mut self, fix: &str, atoms: usize, evaluate: BoundaryForces) -> Result<(), String> {
        let f = self.functions;
        if !self.boundary.is_null() {
            return Err("a boundary is set, whose fix may exist: clear LAMMPS before".into());
        }
        let name = text(fix.to_string())?;
        let boundary = Box::into_raw(Box::new(Boundary {
            functions: f,
            handle: self.handle,
            fix: name.clone(),
            several_ranks: self.ranks() > 1,
            ids: (1..=atoms as c_int).collect(),
            positions: vec![[0.0; 3]; atoms],
            forces: vec![[0.0; 3]; atoms],
            evaluate,
        }));
        self.boundary = boundary;
        // SAFETY: the boundary outlives the fix: it is freed after `clear`, which removes the fix, or when LAMMPS ends.
        unsafe {
            (f.lammps_fix_external_set_vector_length)(self.handle, name.as_ptr(), 3);
            self.check()?;
            (f.lammps_set_fix_external_callback)(self.handle, name.as_ptr(), call_back, boundary.cast());
        }
        self.check()
    }

    /// Frees the boundary of a fix that does not exist any more.
    fn release_boundary(&mut self) {
        let boundary = std::mem::replace(&mut self.boundary, std::ptr::null_mut());
        if !boundary.is_null() {
            // SAFETY: it comes from `Box::into_raw`, and nothing else has it after its fix was removed.
            drop(unsafe { Box::from_raw(boundary) });
        }
    }

    /// Removes all atoms and fixes of the instance, and the boundary.
    ///
    /// # Errors
    /// As [`LammpsInstance::command`].
    pub fn clear(&mut self) -> Result<(), String> {
        self.command("clear")?;
        self.release_boundary();
        Ok(())
    }

    /// Ends LAMMPS, which then prints its total time, and MPI. All ranks must call it; after an error the process ends without it.
    pub fn close(mut self) {
        // SAFETY: the handle is open and not used any more; the library stays open.
        unsafe { (self.functions.lammps_close)(self.handle) };
        self.release_boundary();
        // SAFETY: no instance is left.
        unsafe { (self.functions.lammps_mpi_finalize)() };
    }
}

fn text(words: String) -> Result<CString, String> {
    CString::new(words).map_err(|e| format!("a text with a zero byte: {e}"))
}

/// LAMMPS calls this at every evaluation of forces.
extern "C" fn call_back(
    context: *mut c_void,
    _step: i64,
    count: c_int,
    ids: *mut c_int,
    x: *mut *mut c_double,
    f: *mut *mut c_double,
) {
    // SAFETY: LAMMPS hands back the context of `set_boundary`, of which no other reference is in use meanwhile.
    let boundary = unsafe { &mut *context.cast::<Boundary>() };
    let work = std::panic::AssertUnwindSafe(|| {
        let n = usize::try_from(count).unwrap_or(0);
        // SAFETY: rows of LAMMPS's arrays of positions and forces are contiguous, with one row per atom of this rank.
        let (ids, x, f) = unsafe {
            match n {
                0 => (&[][..], &[][..], &mut [][..]),
                _ => (
                    std::slice::from_raw_parts(ids.cast_const(), n),
                    std::slice::from_raw_parts((*x).cast::<[f64; 3]>().cast_const(), n),
                    std::slice::from_raw_parts_mut((*f).cast::<[f64; 3]>(), n),
                ),
            }
        };
        boundary.evaluate(ids, x, f);
    });
    if std::panic::catch_unwind(work).is_err() {
        // The message of the panic is printed already. LAMMPS cannot pass it on.
        std::process::abort();
    }
}

impl Boundary {
    fn evaluate(&mut self, ids: &[c_int], x: &[[f64; 3]], f: &mut [[f64; 3]]) {
        let atoms = self.ids.len();
        let own = |id: c_int| usize::try_from(id - 1).ok().filter(|k| *k < atoms);
        if self.several_ranks {
            // SAFETY: as many ids as stated, and three numbers for each.
            unsafe {
                (self.functions.lammps_gather_atoms_subset)(
                    self.handle,
                    c"x".as_ptr(),
                    1,
                    3,
                    atoms as c_int,
                    self.ids.as_mut_ptr(),
                    self.positions.as_mut_ptr().cast(),
                );
            }
        } else {
            self.positions.fill([0.0; 3]);
            ids.iter().zip(x).for_each(|(id, x)| own(*id).into_iter().for_each(|k| self.positions[k] = *x));
        }
        // Atoms that no rank has are left at the corner of the box, where no site is.
        let lost = self.positions.iter().filter(|x| **x == [0.0; 3]).count();
        if lost > 0 {
            // LAMMPS would notice it later, and does not know why. At 98 nm with six cells of moving atoms an atom left in the second load.
            eprintln!(
                "ERROR: {lost} of {atoms} atoms left the elastic base: the crystal slips down to it. Use more depth_cells"
            );
            std::process::exit(1);
        }
        let energy = (self.evaluate)(&self.positions, &mut self.forces);
        let mut total = [0.0; 3];
        self.forces.iter().for_each(|force| (0..3).for_each(|c| total[c] += force[c]));
        for (id, f) in ids.iter().zip(f) {
            *f = own(*id).map_or([0.0; 3], |k| self.forces[k]);
        }
        // SAFETY: the handle is open, the id ends with a zero; numbers of vectors count from one.
        unsafe {
            (self.functions.lammps_fix_external_set_energy_global)(self.handle, self.fix.as_ptr(), energy);
            for (c, sum) in total.iter().enumerate() {
                (self.functions.lammps_fix_external_set_vector)(self.handle, self.fix.as_ptr(), c as c_int + 1, -sum);
            }
        }
    }
}
