//! A revolution of a multi-beam lidar as a PNG: its ranges, and the view from above.

use std::io;
use std::path::Path;

use crate::output_file::OutputFile;

/// Width of the picture, pixels.
const WIDTH: usize = 900;
/// Rows of pixels a ring.
const RING_HEIGHT: usize = 4;
/// Range that is drawn darkest, m.
const DARK: f32 = 60.0;
/// Heights between which the colour goes from blue to red, m, in the frame of the sensor.
const HEIGHTS: [f32; 2] = [-2.0, 4.0];

type Colour = [u8; 3];

/// Draws an organised cloud of so many rings, to `reach` m in the view from above.
///
/// # Errors
/// What the operating system or the encoder says.
pub fn write(path: &Path, cloud: &[Option<[f32; 3]>], rings: usize, reach: f32) -> io::Result<()> {
    let (columns, above) = (cloud.len() / rings.max(1), rings * RING_HEIGHT);
    let mut pixels = vec![[0_u8; 3]; WIDTH * (above + WIDTH)];
    for (row, target) in pixels[..WIDTH * above].as_chunks_mut::<WIDTH>().0.iter_mut().enumerate() {
        let ring = &cloud[row / RING_HEIGHT * columns..][..columns];
        for (x, pixel) in target.iter_mut().enumerate() {
            // Column 0 looks ahead, columns go clockwise: ahead into the middle.
            let column = (x * columns / WIDTH + columns / 2) % columns.max(1);
            if let Some(Some(point)) = ring.get(column) {
                let range = point.iter().map(|value| value * value).sum::<f32>().sqrt();
                *pixel = [(255.0 - 215.0 * (range / DARK).min(1.0)) as u8; 3];
            }
        }
    }
    for [x, y, z] in cloud.iter().copied().flatten() {
        let pixel = |metres: f32| (0.5 * WIDTH as f32 * (1.0 - metres / reach)).floor();
        let (across, down) = (pixel(y), pixel(x));
        let inside = 0.0..WIDTH as f32;
        if inside.contains(&across) && inside.contains(&down) {
            pixels[(above + down as usize) * WIDTH + across as usize] = of_height(z);
        }
    }
    let mut file = OutputFile::create(path)?;
    let mut encoder = png::Encoder::new(&mut file, WIDTH as u32, (above + WIDTH) as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()?;
    file.finish()
}

/// From blue through green to red.
fn of_height(height: f32) -> Colour {
    let share = ((height - HEIGHTS[0]) / (HEIGHTS[1] - HEIGHTS[0])).clamp(0.0, 1.0);
    let ramp = |middle: f32| (255.0 * (1.0 - 2.0 * (share - middle).abs()).clamp(0.0, 1.0)) as u8;
    [ramp(1.0).max(40), ramp(0.5).max(40), ramp(0.0).max(40)]
}
