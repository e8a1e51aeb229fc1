//! How do several threads give the bits of one? Views are worked on in chunks of fixed size, and chunks are combined in order.

/// Views in a chunk: enough work to be worth handing over (some 50 us), few enough for a hundred views to be shared out.
pub(super) const CHUNK: usize = 16;
/// With fewer items the threads' meeting costs more than they save.
#[cfg(feature = "parallel")]
const WORTH_SHARING: usize = 4 * CHUNK;

/// Applies `work` to the chunks of `items`, with the chunk's number, and hands the results to `combine` in order.
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
