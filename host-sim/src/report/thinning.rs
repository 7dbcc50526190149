//! Fewer points that look the same.

/// At most about `limit` of the points of a line, in which each interval keeps its lowest and its highest point, so
/// that no peak is lost. Points that are not finite, which interrupt the line, are kept.
pub fn thin_line(points: &[(f64, f64)], limit: usize) -> Vec<(f64, f64)> {
    let size = points.len().div_ceil((limit / 4).max(1));
    if points.len() <= limit || size < 5 {
        return points.to_vec();
    }
    let mut thinned = Vec::with_capacity(limit);
    for bucket in points.chunks(size) {
        let finite = || (0..bucket.len()).filter(|index| bucket[*index].1.is_finite());
        let by_height = |a: &usize, b: &usize| bucket[*a].1.total_cmp(&bucket[*b].1);
        let gap = (0..bucket.len()).find(|index| !bucket[*index].1.is_finite());
        let mut kept: Vec<usize> =
            [Some(0), finite().min_by(by_height), finite().max_by(by_height), gap, Some(bucket.len() - 1)]
                .into_iter()
                .flatten()
                .collect();
        kept.sort_unstable();
        kept.dedup();
        thinned.extend(kept.into_iter().map(|index| bucket[index]));
    }
    thinned
}

/// At most `limit` of the points, evenly chosen.
pub fn thin_points(points: &[(f64, f64)], limit: usize) -> Vec<(f64, f64)> {
    points.iter().step_by(points.len().div_ceil(limit.max(1)).max(1)).copied().collect()
}

/// At most about `limit` points of a path in the plane, evenly chosen, with its end.
pub fn thin_path(points: &[(f64, f64)], limit: usize) -> Vec<(f64, f64)> {
    let mut thinned = thin_points(points, limit);
    thinned.extend(points.last());
    thinned
}

#[cfg(test)]
mod tests {
    use super::{thin_line, thin_points};

    #[test]
    fn peaks_survive() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|index| (f64::from(index), 0.0)).collect();
        points[77_777].1 = 5.0;
        points[33_333].1 = -5.0;
        points[55_555].1 = f64::NAN;
        let thinned = thin_line(&points, 1000);
        assert!(thinned.len() <= 1250, "{}", thinned.len());
        assert!(thinned.contains(&(77_777.0, 5.0)) && thinned.contains(&(33_333.0, -5.0)));
        assert!(thinned.iter().any(|point| point.1.is_nan()));
        assert!(thinned.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(thinned.last(), points.last());
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [(0.0, 1.0), (1.0, 2.0)];
        assert_eq!(thin_line(&points, 10), points);
        assert_eq!(thin_points(&points, 10), points);
        assert!(thin_line(&[], 10).is_empty() && thin_points(&[], 10).is_empty());
        assert_eq!(thin_points(&[(0.0, 0.0); 1001], 100).len(), 91);
    }
}
