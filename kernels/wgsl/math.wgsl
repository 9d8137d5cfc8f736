// Bit tricks that the traced stages call; twins of `Real::frexp` and `Real::exp2_whole`.

fn mantissa(x: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0x807fffffu) | 0x3f000000u);
}

fn exponent(x: f32) -> f32 {
    return f32(i32((bitcast<u32>(x) >> 23u) & 0xffu) - 126);
}

fn exp2_whole(x: f32) -> f32 {
    return bitcast<f32>(u32(i32(x) + 127) << 23u);
}
