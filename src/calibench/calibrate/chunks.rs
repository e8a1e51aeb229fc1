//! How do several threads give the bits of one? Views are worked on in chunks of fixed size, and chunks are
//! combined in order.

/// Views in a chunk: enough work to be worth handing over (some 50 us), few enough for a hundred views to be
/// shared out.
pub(super) const CHUNK: usize = 16;
/// With fewer items the threads' meeting costs more than they save.
#[cfg(feature = "parallel")]
const WORTH_SHARING: usize = 4 * CHUNK;

/// Does `work` over `items` items on a thread of the pool where it is worth sharing: there one [`fold`] after
/// another finds the other threads awake, while each that is called from outside the pool puts its caller to
/// sleep and wakes it up again.
pub(super) fn in_pool<R: Send>(items: usize, work: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "parallel")]
    if items >= WORTH_SHARING && rayon::current_num_threads() > 1 {
        return rayon::scope(|_| work());
    }
    #[cfg(not(feature = "parallel"))]
    let _ = items;
    work()
}

/// Applies `work` to the chunks of `items`, with the chunk's number, and hands the results to `combine` in
/// order.
pub(super) fn fold<T: Send, R: Send>(
    items: &mut [T],
    work: impl Fn(usize, &mut [T]) -> R + Sync,
    mut combine: impl FnMut(R),
) {
    #[cfg(feature = "parallel")]
    if items.len() >= WORTH_SHARING && rayon::current_num_threads() > 1 {
        use rayon::prelude::*;
        let parts: Vec<R> =
            items.par_chunks_mut(CHUNK).enumerate().map(|(index, chunk)| work(index, chunk)).collect();
        parts.into_iter().for_each(combine);
        return;
    }
    for (index, chunk) in items.chunks_mut(CHUNK).enumerate() {
        combine(work(index, chunk));
    }
}

/// One result for each of `items`, in order.
pub(super) fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    if items.len() >= WORTH_SHARING && rayon::current_num_threads() > 1 {
        use rayon::prelude::*;
        return items
            .par_iter()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(index, item)| work(index, item))
            .collect();
    }
    items.iter().enumerate().map(|(index, item)| work(index, item)).collect()
}
