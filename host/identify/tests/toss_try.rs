use softdock_campaign::{Rig, rig::RigModel};
use softdock_identify::contact::{population::PopulationSize, toss::*};
use std::path::Path;
#[test]
fn try_it() {
    let rig = Rig::load(Path::new("../../campaigns/rigs/cube_toss.toml")).unwrap();
    let RigModel::Toss(own) = rig.plant.clone() else { panic!() };
    let path = std::path::PathBuf::from("/work/shared/data/cube-tosses/tosses.csv");
    let t = std::time::Instant::now();
    let tosses = Tosses::read(&rig, &own, &[&path], 0.5).unwrap();
    println!("read {:?}", t.elapsed());
    let found = fit_toss(&tosses, PopulationSize { sets: 64, generations: 16, ..Default::default() }).unwrap();
    println!("fit {:?} {:#?}", t.elapsed(), found);
    let nominal = softdock_kernels::fields::to_vec(&own.values);
    for held in [false, true] {
        let all = OpenLoopToss::of(&tosses, held);
        let errors = open_loop(&all, &[nominal.clone(), found.values.clone()]);
        for e in errors {
            let n = e.len() as f64;
            let mut p: Vec<f64> = e.iter().map(|e| e.position_m).collect();
            let mut r: Vec<f64> = e.iter().map(|e| e.rotation_rad.to_degrees()).collect();
            let (mp, mr) = (p.iter().sum::<f64>() / n, r.iter().sum::<f64>() / n);
            p.sort_by(f64::total_cmp);
            r.sort_by(f64::total_cmp);
            println!(
                "held {held} n {n} mean {:.2} mm {mr:.2} deg median {:.2} mm {:.2} deg",
                1e3 * mp,
                1e3 * p[p.len() / 2],
                r[r.len() / 2]
            );
        }
        println!("{:?}", t.elapsed());
    }
}
