//! Do the examples do what they say?

#[path = "../examples/from_photographs.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
mod from_photographs;
#[path = "../examples/from_points.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
mod from_points;
#[path = "../examples/noise_study.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
mod noise_study;
#[path = "../examples/own_gate.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
mod own_gate;
#[path = "../examples/own_layout.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
pub mod own_layout;
#[path = "../examples/own_loss.rs"]
#[allow(dead_code, reason = "its `main` is for the command line")]
mod own_loss;

#[test]
fn points_and_photographs_give_a_camera() {
    from_points::run(&from_points::made_up()).unwrap();
    let fx = from_photographs::run(&from_photographs::rendered().unwrap()).unwrap();
    // Noise-free photographs: a detector's error of some thousandths of a pixel, and the bias of discs.
    assert!((fx - 600.0).abs() < 1.0, "{fx}");
}

#[test]
fn marks_in_any_layout_give_a_camera() {
    let far = own_layout::run().unwrap();
    assert!(far < 4.0, "{far}");
}

#[test]
fn a_robust_loss_resists_what_least_squares_does_not() {
    let errors = own_loss::run().unwrap();
    assert!(errors[0] > 10.0 * errors[1] && errors[0] > 10.0 * errors[2], "{errors:?}");
}

#[test]
fn a_study_meets_the_bound() {
    // Hundred draws: the spread is known to a fourteenth; four of its standard deviations.
    assert!(noise_study::run().unwrap().iter().all(|ratio| (ratio - 1.0).abs() < 4.0 / 14.0));
}

#[test]
fn the_gate_trusts_the_sound_solver_and_not_the_other() {
    assert_eq!(own_gate::run().unwrap(), (true, false));
}
