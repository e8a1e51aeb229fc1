//! Every test that crosses rooms, in one program: a program of its own for each file would be linked twenty
//! times over.
//!
//! `cargo test --test all golden::` runs those of `tests/golden.rs`.

mod any_lens;
mod beforehand;
mod book;
mod camera_files;
mod certified;
mod chapter_scene;
mod command;
mod data;
mod dependencies;
mod detect_chessboard;
mod detect_circles;
mod detect_corners;
mod detect_photos;
mod downstream;
mod errors;
mod examples;
mod explain;
mod failing_disk;
mod fuzz_seeds;
mod gate;
mod golden;
mod hard_sets;
mod hostile;
mod laboratory;
mod layout;
mod lens_models;
mod new;
mod photo_command;
mod photo_verbs;
mod planar_single_plane;
mod planar_statistics;
mod printed_board;
mod program;
mod provenance;
mod readme;
mod real_corner_files;
mod real_data;
mod real_ninepoint;
mod rectify;
mod render;
mod right_minimum;
mod shell;
mod study;
mod study_faults;
mod study_folder;
mod study_parquet;
mod study_statistics;
mod thread_count;
mod tsai;
mod validate;
mod verb_examples;
mod writers;
