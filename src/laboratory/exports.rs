//! What does a page call? Plain functions over memory, without glue: it writes the numbers of a question to
//! [`lab_input`], calls the question, and reads the answer from [`lab_output`], or the words of a refusal
//! from [`lab_refusal`].

use super::questions::{Answer, Question};
use std::sync::{Mutex, MutexGuard, PoisonError};

static INPUT: Mutex<Vec<f64>> = Mutex::new(Vec::new());
static OUTPUT: Mutex<Vec<f64>> = Mutex::new(Vec::new());
static REFUSAL: Mutex<String> = Mutex::new(String::new());

/// What a page leaves behind when it fails is not relied on.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where the page writes the numbers of its next question, so many. Valid until it is asked for again.
#[unsafe(no_mangle)]
pub extern "C" fn lab_input(length: usize) -> *mut f64 {
    let mut input = lock(&INPUT);
    input.clear();
    input.resize(length, 0.0);
    input.as_mut_ptr()
}

/// The numbers of the last answer. Valid until the next question.
#[unsafe(no_mangle)]
pub extern "C" fn lab_output() -> *const f64 {
    lock(&OUTPUT).as_ptr()
}

/// Why the last question has no answer, UTF-8. Valid until the next question.
#[unsafe(no_mangle)]
pub extern "C" fn lab_refusal() -> *const u8 {
    lock(&REFUSAL).as_ptr()
}

/// Keeps an answer, and gives its length; of a refusal the negative length of its words.
fn keep(question: Question) -> isize {
    let answer: Answer = question(&lock(&INPUT));
    match answer {
        Ok(numbers) => {
            let length = numbers.len() as isize;
            *lock(&OUTPUT) = numbers;
            length
        }
        Err(words) => {
            let length = words.len() as isize;
            *lock(&REFUSAL) = words;
            -length
        }
    }
}

/// A question as a function of its own.
macro_rules! export {
    ($($name:ident = $question:path;)*) => { $(
        /// The question of this name; the length of its answer, or the negative length of a refusal.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name() -> isize {
            keep($question)
        }
    )* };
}

export! {
    lab_predict = super::calibration::predict;
    lab_observe = super::calibration::observe;
    lab_calibrate = super::calibration::calibrate_once;
    lab_trials = super::trials::trials;
    lab_spread = super::trials::spread;
    lab_uncertainty = super::uncertainty::uncertainty;
    lab_distort = super::lens::distort;
    lab_bend = super::lens::bend;
    lab_photograph = super::picture::photograph;
    lab_rectify = super::picture::rectify;
    lab_nine_points = super::plane::nine_points;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page has one thread; tests have several, and the buffers are one.
    static ONE_PAGE: Mutex<()> = Mutex::new(());

    #[test]
    fn an_answer_lies_where_the_page_reads_it() {
        let _page = lock(&ONE_PAGE);
        lab_input(14);
        lock(&INPUT).copy_from_slice(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(lab_spread(), 8);
        let output = lock(&OUTPUT);
        assert_eq!((output[0], output[7]), (2.0, 1.0));
        assert_eq!(output.as_ptr(), {
            drop(output);
            lab_output()
        });
    }

    #[test]
    fn a_refusal_is_words() {
        let _page = lock(&ONE_PAGE);
        lab_input(1);
        let length = lab_calibrate();
        assert_eq!(lock(&REFUSAL).len() as isize, -length);
        assert!(lock(&REFUSAL).contains("10 numbers"));
        assert!(!lab_refusal().is_null());
    }
}
