//! Three linear equations.

/// The solution of three equations by elimination; None if they have none.
pub(super) fn solved(mut rows: [[f64; 4]; 3]) -> Option<[f64; 3]> {
    for pivot in 0..3 {
        let best = (pivot..3).max_by(|a, b| libm::fabs(rows[*a][pivot]).total_cmp(&libm::fabs(rows[*b][pivot])))?;
        rows.swap(pivot, best);
        let lead = rows[pivot];
        if libm::fabs(lead[pivot]) < 1e-9 {
            return None;
        }
        for (number, row) in rows.iter_mut().enumerate() {
            if number != pivot {
                let factor = row[pivot] / lead[pivot];
                for (value, lead) in row.iter_mut().zip(lead) {
                    *value -= factor * lead;
                }
            }
        }
    }
    Some([0, 1, 2].map(|at| rows[at][3] / rows[at][at]))
}
