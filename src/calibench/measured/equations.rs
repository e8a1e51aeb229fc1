//! How are hundreds of poses and marks solved for? Poses are eliminated view by view; camera and marks stay,
//! one dense symmetric system.
//!
//! With the shared unknowns `a` (free parameters, coordinates of marks), `A` their block, `C_i` that of a
//! pose, `B_i` the coupling and `C_i = L_i L_i^T`, `W_i = L_i^-1 B_i^T`, `z_i = L_i^-1 g_i`:
//!
//! ```text
//! S = A - sum W_i^T W_i,   S d_a = -(g_a - sum W_i^T z_i),   L_i^T d_i = -(z_i + W_i d_a)
//! ```
//! A view couples with the marks that it shows only, so that `W_i` has columns for those.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix6, Vector6};

/// The share of a view.
#[derive(Debug, Clone)]
pub(super) struct ViewEquations {
    pub square: Matrix6<f64>,
    pub gradient: Vector6<f64>,
    /// Which shared unknowns the columns of `coupling` are.
    pub columns: Vec<usize>,
    /// 6 x columns.
    pub coupling: DMatrix<f64>,
}

/// `J^T W J`, `J^T W r` and the cost.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    /// Of the shared unknowns; the lower triangle is summed, then mirrored.
    pub matrix: DMatrix<f64>,
    pub gradient: DVector<f64>,
    pub views: Vec<ViewEquations>,
    pub cost: f64,
}

/// A step of all unknowns.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub shared: DVector<f64>,
    pub poses: Vec<Vector6<f64>>,
    /// Fall of the cost that the undamped equations promise.
    pub predicted_gain: f64,
}

/// A pose's factors.
struct Factors {
    /// Lower triangle of its block.
    lower: Matrix6<f64>,
    /// `W`, 6 x columns.
    coupling: DMatrix<f64>,
    /// `z`.
    gradient: Vector6<f64>,
}

/// Equations without the poses.
pub(super) struct Reduced {
    /// `S`.
    pub matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    factors: Vec<Factors>,
}

/// Covariance for unit noise: `Q` of the shared unknowns, and of each pose its block and that with the shared
/// ones.
pub(super) struct Inverse {
    pub shared: DMatrix<f64>,
    pub poses: Vec<Matrix6<f64>>,
    /// Shared unknowns x 6.
    pub cross: Vec<DMatrix<f64>>,
}

impl Equations {
    pub fn new(shared: usize) -> Equations {
        Equations {
            matrix: DMatrix::zeros(shared, shared),
            gradient: DVector::zeros(shared),
            views: Vec::new(),
            cost: 0.0,
        }
    }

    /// Copies the lower triangle to the upper one.
    pub fn mirror(&mut self) {
        self.matrix.fill_upper_triangle_with_lower_triangle();
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.matrix.nrows() + 6 * self.views.len()
    }

    /// The equations of `H + damping diag(H)` without the poses; `None` where a pose is undetermined.
    pub fn reduced(&self, damping: f64) -> Option<Reduced> {
        let mut matrix = self.matrix.clone();
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] *= 1.0 + damping);
        let mut gradient = self.gradient.clone();
        let mut factors = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let mut square = view.square;
            (0..6).for_each(|i| square[(i, i)] *= 1.0 + damping);
            let lower = square.cholesky()?.l();
            let coupling = lower.solve_lower_triangular(&view.coupling)?;
            let z = lower.solve_lower_triangular(&view.gradient)?;
            for (j, &column) in view.columns.iter().enumerate() {
                let own = coupling.column(j);
                gradient[column] -= own.dot(&z);
                for (i, &row) in view.columns.iter().enumerate().skip(j) {
                    matrix[(row, column)] -= own.dot(&coupling.column(i));
                }
            }
            factors.push(Factors { lower, coupling, gradient: z });
        }
        // Columns of a view ascend, so that all was subtracted from the lower triangle.
        matrix.fill_upper_triangle_with_lower_triangle();
        Some(Reduced { matrix, gradient, factors })
    }

    /// Matrix and gradient of the first shared unknowns without the others and the poses; `None` where those
    /// are undetermined.
    pub fn of_first(&self, count: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let Reduced { matrix, gradient, .. } = self.reduced(0.0)?;
        let others = matrix.nrows() - count;
        let (own, of_own) = (matrix.view((0, 0), (count, count)).into_owned(), gradient.rows(0, count));
        if others == 0 {
            return Some((own, of_own.into_owned()));
        }
        let factor = matrix.view((count, count), (others, others)).into_owned().cholesky()?;
        let coupling = matrix.view((0, count), (count, others));
        let follow = factor.solve(&coupling.transpose());
        let of_others = gradient.rows(count, others);
        Some((own - coupling * &follow, of_own - follow.transpose() * of_others))
    }

    /// The step of `H + damping diag(H)`; `None` where that is not positive definite.
    pub fn solve(&self, damping: f64) -> Option<Step> {
        let reduced = self.reduced(damping)?;
        let shared = match reduced.cholesky() {
            Some(factor) => -factor.solve(&reduced.gradient),
            None if self.matrix.is_empty() => DVector::zeros(0),
            None => return None,
        };
        let gain_of = |g: f64, d: f64, diagonal: f64| d * (damping * diagonal * d - g);
        let mut predicted_gain: f64 =
            (0..shared.len()).map(|i| gain_of(self.gradient[i], shared[i], self.matrix[(i, i)])).sum();
        let mut poses = Vec::with_capacity(self.views.len());
        for (view, factors) in self.views.iter().zip(&reduced.factors) {
            let pose = factors.follow(view, &shared, 1.0)?;
            predicted_gain +=
                (0..6).map(|i| gain_of(view.gradient[i], pose[i], view.square[(i, i)])).sum::<f64>();
            poses.push(pose);
        }
        Some(Step { shared, poses, predicted_gain })
    }

    /// How poses follow a step of the shared unknowns at least cost.
    pub fn following(&self, reduced: &Reduced, shared: &DVector<f64>) -> Option<Vec<Vector6<f64>>> {
        self.views.iter().zip(&reduced.factors).map(|(view, f)| f.follow(view, shared, 0.0)).collect()
    }

    /// The inverse of the whole matrix, by its blocks; `None` if it is singular.
    pub fn inverse(&self) -> Option<Inverse> {
        let reduced = self.reduced(0.0)?;
        let shared = match reduced.cholesky() {
            Some(factor) => factor.inverse(),
            None if self.matrix.is_empty() => DMatrix::zeros(0, 0),
            None => return None,
        };
        let (mut poses, mut cross) = (Vec::new(), Vec::new());
        for (view, factors) in self.views.iter().zip(&reduced.factors) {
            // The pose follows with -V a, V = L^-T W.
            let upper = factors.lower.transpose();
            let follow = upper.solve_upper_triangular(&factors.coupling)?;
            let mut with_shared = DMatrix::zeros(shared.nrows(), 6);
            for (k, &column) in view.columns.iter().enumerate() {
                let moved = follow.column(k);
                for i in 0..shared.nrows() {
                    for c in 0..6 {
                        with_shared[(i, c)] -= shared[(i, column)] * moved[c];
                    }
                }
            }
            let own = factors.lower.solve_lower_triangular(&Matrix6::identity())?;
            let mut block = own.transpose() * own;
            for (k, &column) in view.columns.iter().enumerate() {
                for a in 0..6 {
                    for b in 0..6 {
                        block[(a, b)] -= follow[(a, k)] * with_shared[(column, b)];
                    }
                }
            }
            poses.push(0.5 * (block + block.transpose()));
            cross.push(with_shared);
        }
        Some(Inverse { shared, poses, cross })
    }
}

impl Reduced {
    fn cholesky(&self) -> Option<Cholesky<f64, Dyn>> {
        if self.matrix.is_empty() {
            return None;
        }
        self.matrix.clone().cholesky()
    }
}

impl Factors {
    /// The pose's part of a step, `own` times its gradient counted: `L^T d = -(own z + W a)`.
    fn follow(&self, view: &ViewEquations, shared: &DVector<f64>, own: f64) -> Option<Vector6<f64>> {
        let mut right = own * self.gradient;
        for (k, &column) in view.columns.iter().enumerate() {
            right += self.coupling.column(k) * shared[column];
        }
        self.lower.transpose().solve_upper_triangular(&-right)
    }
}
