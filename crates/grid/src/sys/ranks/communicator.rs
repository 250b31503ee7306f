//! What ranks exchange bytes through.

/// How several ranks exchange bytes. Counts are in bytes, and parts are in the order of the ranks.
pub trait Communicator: std::fmt::Debug + Send + Sync {
    /// Number of ranks.
    fn count(&self) -> usize;

    /// Number of this rank.
    fn own(&self) -> usize;

    /// Largest number of threads of a rank.
    fn threads(&self) -> usize;

    /// Points of the smallest grid that is shared.
    fn smallest_shared(&self) -> usize;

    /// Whether each rank is on the machine of this one.
    fn on_this_machine(&self) -> &[bool];

    /// Sends the other ranks their parts of `send`, and receives their parts of `receive`.
    fn exchange(&self, send: (&[u8], &[usize]), receive: (&mut [u8], &[usize]));

    /// The parts of all ranks, on all ranks.
    fn gather(&self, local: &[u8], parts: (&mut [u8], &[usize]));

    /// The parts of all ranks, of any size, on the first one, which alone has the place for them.
    fn gather_on_first(&self, local: &[u8], parts: (&mut [u8], &[usize]));

    /// What the first rank says.
    fn first_says(&self, say: u8) -> u8;

    /// Ends all ranks with this exit code.
    fn abort(&self, code: u8);
}
