//! Least squares: sums of normal equations, and what solves them.

/// The normal equations of a least-squares problem.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    /// Row by row.
    matrix: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl LeastSquares {
    /// A problem of so many unknowns, of which nothing is known yet.
    pub fn new(unknowns: usize) -> Self {
        Self {
            matrix: vec![vec![0.0; unknowns]; unknowns],
            right: vec![0.0; unknowns],
        }
    }

    /// Takes in one equation: the unknowns, each times its slope, should be this in sum.
    pub fn add(&mut self, slopes: &[f64], sum: f64) {
        for ((row, right), slope) in self.matrix.iter_mut().zip(&mut self.right).zip(slopes) {
            for (cell, other) in row.iter_mut().zip(slopes) {
                *cell += slope * other;
            }
            *right += slope * sum;
        }
    }

    /// Takes in the equations of another problem of the same unknowns.
    pub fn merge(&mut self, other: &Self) {
        for (row, more) in self.matrix.iter_mut().zip(&other.matrix) {
            for (cell, more) in row.iter_mut().zip(more) {
                *cell += more;
            }
        }
        for (right, more) in self.right.iter_mut().zip(&other.right) {
            *right += more;
        }
    }

    /// The unknowns that leave the least sum of squares. What is added to the diagonal, as a part of its mean, is the
    /// damping: with some, what no equation shows is 0. `None` when no equation depends on any of them.
    pub fn solve(mut self, damping: f64) -> Option<Vec<f64>> {
        let count = self.right.len();
        let trace: f64 = (0..count).map(|i| self.matrix[i][i]).sum();
        if trace.is_nan() || trace <= 0.0 {
            return None;
        }
        for i in 0..count {
            self.matrix[i][i] += damping * trace / count as f64;
        }
        // Symmetric and, damped, positive, so that no pivot is 0.
        for i in 0..count {
            for j in i + 1..count {
                let factor = self.matrix[j][i] / self.matrix[i][i];
                for k in i..count {
                    self.matrix[j][k] -= factor * self.matrix[i][k];
                }
                self.right[j] -= factor * self.right[i];
            }
        }
        let mut unknowns = vec![0.0; count];
        for i in (0..count).rev() {
            let known: f64 = (i + 1..count)
                .map(|k| self.matrix[i][k] * unknowns[k])
                .sum();
            unknowns[i] = (self.right[i] - known) / self.matrix[i][i];
        }
        unknowns
            .iter()
            .all(|unknown: &f64| unknown.is_finite())
            .then_some(unknowns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_give_a_line_and_leave_alone_what_nothing_shows() {
        let mut line = LeastSquares::new(2);
        // Through (0, 1), (1, 3) and (2, 5).
        for (x, y) in [(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)] {
            line.add(&[x, 1.0], y);
        }
        let line = line.solve(1e-4).expect("it has a solution");
        assert!(
            (line[0] - 2.0).abs() < 0.01 && (line[1] - 1.0).abs() < 0.01,
            "{line:?}"
        );
        let mut blind = LeastSquares::new(2);
        blind.add(&[2.0, 0.0], -1.0);
        let step = blind.solve(1e-4).expect("the first is seen");
        assert!((step[0] + 0.5).abs() < 0.01 && step[1] == 0.0, "{step:?}");
        let mut dark = LeastSquares::new(1);
        dark.add(&[0.0], 1.0);
        assert!(dark.solve(1e-4).is_none());
    }
}
