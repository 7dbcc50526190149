use agv_host_sim::evaluate::carpark::*;
fn main() {
    let f = agv_host_sim::data::folder().unwrap().join("carpark");
    let (o, rec, rep) = run(&f, Noise::Tight).unwrap();
    println!("{o:?}");
    let mut refs = rec.references.iter().peekable();
    for u in rep.uses.iter().filter(|u| u.time.seconds() < 64.0) {
        let t = u.time.seconds();
        let k = rep.poses.iter().rposition(|p| p.time <= u.time).unwrap();
        let p = rep.poses[k];
        while refs.peek().is_some_and(|r| r.time.seconds() < t) {
            refs.next();
        }
        let e = refs.peek().map(|r| {
            let l = p.pose.compose(&rec.parameters.laser);
            ((l.x - r.x).hypot(l.y - r.y))
        });
        println!(
            "{t:.3} {:?} {:?} res {:?} ratio {:.2} err {:.2} acc {:.2} nis {:.2} sd {:.3}",
            u.landmark,
            u.verdict,
            u.residual,
            u.test_ratio,
            e.unwrap(),
            p.acceptance,
            p.normalised_square,
            (p.covariance[0] + p.covariance[2]).sqrt()
        );
    }
}
