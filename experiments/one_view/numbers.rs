//! The numbers of the record, with their bands.

use super::trial::{Cell, OFF_CENTRE, REFINED, Several, TSAI, exact_error};
use super::{LINEAR_TILT_DEG, TILT_DEG};
use calibench::geometry::Vec2;
use calibench_harness::{Band, ExperimentError, Record};

/// Means over trials of estimates whose refinement stops at half of the digits.
pub(super) fn band() -> Band {
    Band::relative(1e-5, "means over trials of estimates whose refinement stops at half of the digits")
}

/// Bounds lose as many digits as their normal equations have condition.
pub(super) fn bound_band() -> Band {
    Band::relative(1e-7, "the normal equations lose as many digits as they have condition, 1e8 at a degree")
}

/// A bias that may be next to nothing, beside its spread.
pub(super) fn bias_band() -> Band {
    Band::absolute(1e-3, "means over trials of estimates known to 1e-4 px")
}

/// What f, distance and k1 are called.
pub(super) const QUANTITIES: [(&str, &str, &str); 3] =
    [("fx", "px", "focal length"), ("depth", "mm", "distance"), ("k1", "", "coefficient k1")];

pub(super) fn report_tilts(record: &mut Record, tilts: &[Cell]) {
    for cell in tilts {
        let (id, what) = (format!("-{}", cell.tilt_deg), format!(", tilt {} deg", cell.tilt_deg));
        record.exact("").suffix(&id, &what).number(
            "answered",
            cell.answered(),
            "share of views with an answer",
        );
        for (k, (name, unit, quantity)) in QUANTITIES.iter().enumerate() {
            if cell.bound.is_some() {
                let what_bound = format!("Cramer-Rao bound of the {quantity}");
                record.group(*unit, bound_band()).suffix(&id, &what).number(
                    format!("bound-{name}"),
                    cell.bound_of(k),
                    what_bound,
                );
            }
            if cell.is_answered_always() {
                record
                    .group(*unit, band())
                    .suffix(&id, &what)
                    .number(
                        format!("refined-{name}"),
                        cell.rms(REFINED, k),
                        format!("RMS error of the {quantity}, refined"),
                    )
                    .number(
                        format!("tsai-{name}"),
                        cell.rms(TSAI, k),
                        format!("RMS error of the {quantity}, Tsai's own answer"),
                    );
            }
        }
        if cell.is_answered_always() {
            record
                .group("px", bias_band())
                .suffix(&id, &what)
                .number(
                    "bias-off-centre",
                    cell.bias(OFF_CENTRE, 0),
                    "mean error of f, the principal point in the image's centre",
                )
                .group("px", band())
                .number("rmse", cell.rmse_px(REFINED), "mean RMSE")
                .number(
                    "rmse-off-centre",
                    cell.rmse_px(OFF_CENTRE),
                    "mean RMSE, the principal point in the image's centre",
                )
                .exact("")
                .number(
                    "coverage",
                    cell.coverage(REFINED),
                    "share of stated intervals of 95 % that contain f",
                )
                .number(
                    "coverage-off-centre",
                    cell.coverage(OFF_CENTRE),
                    "the same, the principal point in the image's centre",
                );
        }
    }
}

pub(super) fn report_noises(record: &mut Record, noises: &[Cell]) {
    for cell in noises.iter().filter(|cell| cell.is_answered_always()) {
        record
            .group("px", band())
            .suffix(
                format!("-noise-{}", cell.sigma_px),
                format!(", tilt {TILT_DEG} deg, noise {} px", cell.sigma_px),
            )
            .number("refined-fx", cell.rms(REFINED, 0), "RMS error of f, refined")
            .number("tsai-fx", cell.rms(TSAI, 0), "RMS error of f, Tsai's own answer")
            .number(
                "off-centre-fx",
                cell.rms(OFF_CENTRE, 0),
                "RMS error of f, the principal point in the image's centre",
            );
    }
}

pub(super) fn report_several(record: &mut Record, several: &[Several]) {
    for Several { views, bound_fx, .. } in several {
        record.group("px", bound_band()).number(
            format!("bound-fx-views-{views}"),
            *bound_fx,
            format!("Cramer-Rao bound of f from {views} views, the principal point free"),
        );
    }
    for found in several {
        record.group("px", band()).number(
            format!("fx-views-{}", found.views),
            found.rms(),
            format!("RMS error of f from {} views, the principal point free", found.views),
        );
    }
}

/// How well must the principal point be known for the stated uncertainty to mean anything?
pub(super) fn report_tolerance(record: &mut Record, tilts: &[Cell]) -> Result<(), ExperimentError> {
    for cell in tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG) {
        let step = 0.5;
        let slope = |direction: Vec2| -> Result<f64, ExperimentError> {
            let (ahead, behind) = (
                exact_error(cell.tilt_deg, step * direction)?,
                exact_error(cell.tilt_deg, -step * direction)?,
            );
            Ok((ahead - behind) / (2.0 * step))
        };
        // The gradient of f by the principal point: its length is the slope in the worst direction.
        let gradient = Vec2::new(slope(Vec2::x())?, slope(Vec2::y())?).norm();
        let band = Band::relative(1e-5, "a central difference of answers known to 1e-7 px");
        record
            .group("", band)
            .suffix(format!("-{}", cell.tilt_deg), format!(", tilt {} deg", cell.tilt_deg))
            .number(
                "fx-by-centre",
                gradient,
                "change of f by that of the principal point, px by px, in the worst direction",
            )
            .unit("px")
            .number(
                "tolerance",
                cell.bound_of(0) / gradient,
                "error of the principal point in that direction that moves f by its bound",
            );
    }
    Ok(())
}
