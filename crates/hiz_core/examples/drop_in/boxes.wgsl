// Boxes by their low and high corners; `i` is the number of a box in the list that is drawn.

struct Corner { @builtin(position) at: vec4<f32>, @location(0) colour: vec4<f32> }
@group(0) @binding(0) var<uniform> rows: mat4x4<f32>; // of the matrix from world to clip space
@group(0) @binding(1) var<storage> boxes: array<array<vec4<f32>, 2>>; // low and high corners
@vertex fn corner(@builtin(vertex_index) v: u32, @location(0) i: u32) -> Corner {
    // A cube as one strip: bit v of each number says whether corner v is high in x, y or z.
    let is_high = ((vec4(0x287au, 0x02afu, 0x31e3u, 0u) >> vec4(v)) & vec4(1u)) != vec4(0u);
    let tint = unpack4x8unorm((i * 2654435769u) | 0x404040u) * select(0.3, 1.0, is_high.y);
    return Corner(select(boxes[i][0], boxes[i][1], is_high) * rows, tint);
}
@fragment fn shade(in: Corner) -> @location(0) vec4<f32> { return vec4(in.colour.rgb, 1.0); }
