// Philox4x32-10; the twin of `philox.rs`, the same integers.

// High word of a 32 x 32 bit product, by halves.
fn high_product(a: u32, b: u32) -> u32 {
    let al = a & 0xffffu;
    let ah = a >> 16u;
    let bl = b & 0xffffu;
    let bh = b >> 16u;
    let low = al * bl;
    let cross = ah * bl + (low >> 16u);
    let other = al * bh + (cross & 0xffffu);
    return ah * bh + (cross >> 16u) + (other >> 16u);
}

fn philox4x32(start: vec4u, seed: vec2u) -> vec4u {
    var counter = start;
    var key = seed;
    for (var round = 0u; round < 10u; round++) {
        counter = vec4u(
            high_product(0xCD9E8D57u, counter.z) ^ counter.y ^ key.x,
            0xCD9E8D57u * counter.z,
            high_product(0xD2511F53u, counter.x) ^ counter.w ^ key.y,
            0xD2511F53u * counter.x,
        );
        key += vec2u(0x9E3779B9u, 0xBB67AE85u);
    }
    return counter;
}

// Four uniforms in (0, 1) with 24 bits each for a run, tick and channel.
fn uniforms(run: vec2u, tick: u32, channel: u32) -> vec4f {
    let words = philox4x32(vec4u(run.x, run.y, channel, tick), batch.key);
    return (vec4f(words >> vec4u(8u)) + vec4f(0.5)) * (1.0 / 16777216.0);
}
