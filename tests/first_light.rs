mod support;
use support::*;
#[test]
fn look() {
    let gpu = gpu();
    println!("{}", gpu.adapter_name());
    let n: u32 = std::env::var("FRAMES").map(|f| f.parse().unwrap()).unwrap_or(4);
    let settings = std::env::var("SET").unwrap_or_default();
    let settings: Vec<(&str, &str)> = settings.split(' ').filter_map(|s| s.split_once('=')).collect();
    for scene in std::env::var("SCENES").unwrap_or("cornell".into()).split(' ') {
        for t in std::env::var("TECHNIQUES").unwrap_or("normals path-tracer ris restir-di".into()).split(' ') {
            let mut r = renderer(&gpu, builtin(scene), [320, 240], t, &settings);
            render(&mut r, 1);
            let start = std::time::Instant::now();
            let image = render(&mut r, n);
            println!(
                "{scene} {t}: mean {} in {:?}/frame {:?}",
                mean(&image),
                start.elapsed() / n,
                pollster::block_on(r.counters())
            );
            let display = pollster::block_on(r.read_display()).unwrap();
            image::save_buffer(format!("/tmp/look-{scene}-{t}.png"), &display, 320, 240, image::ColorType::Rgba8)
                .unwrap();
        }
    }
}
