// Twin of `src/random.rs`: Philox 4x32-10, bit for bit.
// Source: Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, SC11 (2011).

// The upper half of a product of 64 bits, from products of 16 by 16 that fit a word.
fn mul_high(a: u32, b: u32) -> u32 {
    let a_low = a & 0xffffu;
    let b_low = b & 0xffffu;
    let a_high = a >> 16u;
    let b_high = b >> 16u;
    let first = a_high * b_low + ((a_low * b_low) >> 16u);
    let second = a_low * b_high + (first & 0xffffu);
    return a_high * b_high + (first >> 16u) + (second >> 16u);
}

// Ten rounds of Philox: four random words from a counter and a key.
fn philox(start: vec4<u32>, seed: vec2<u32>) -> vec4<u32> {
    var counter = start;
    var key = seed;
    for (var round = 0u; round < 10u; round++) {
        counter = vec4<u32>(
            mul_high(0xcd9e8d57u, counter.z) ^ counter.y ^ key.x,
            0xcd9e8d57u * counter.z,
            mul_high(0xd2511f53u, counter.x) ^ counter.w ^ key.y,
            0xd2511f53u * counter.x,
        );
        key = key + vec2<u32>(0x9e3779b9u, 0xbb67ae85u);
    }
    return counter;
}

// The upper 24 bits of a word as a number in [0, 1), exact.
fn unit(word: u32) -> f32 {
    return f32(word >> 8u) * 5.9604645e-8;
}

// A whole number below `bound` from a word.
fn below(word: u32, bound: u32) -> u32 {
    return mul_high(word, bound);
}
