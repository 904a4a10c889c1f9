//! What becomes of an earlier recording where a new one is to be.

/// What to do if the folder holds a run already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IfExists {
    /// Leave it alone and fail.
    Refuse,
    /// Delete those files that its manifest names, if they are as they were written. A folder in which one was changed,
    /// or another file is in the way, is refused; other files stay.
    Replace,
}
