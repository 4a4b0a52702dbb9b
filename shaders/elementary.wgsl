// Twin of `src/scalar/elementary.rs`: our own sine, cosine, tangent, inverse tangent and
// exponential, because WGSL only promises 2^-11 for `sin` and `cos` and 4096 ULP for `atan`. Same functions,
// same order, same operations.
// Drivers may regroup literals, so no product has more than one.
//
// They work on four figures side by side, one per wheel: polynomials are long chains of dependent operations, and
// one chain fills the other's waits, as `Pair` in `src/scalar/pair.rs` has it on the processor.

// Figures of the wheels FL, FR, RL, RR.
alias Wheels = vec4<f32>;

// Whether `x` is a number, by its exponent: a driver may assume away comparisons that ask for NaN.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// `cos(atan x)`, and -1 below zero, else +1: twins of the provided methods of `Real` in `src/scalar/mod.rs`.
fn sign_of(x: Wheels) -> Wheels {
    return select(Wheels(1.0), Wheels(-1.0), x < Wheels(0.0));
}

fn cos_atan(x: Wheels) -> Wheels {
    return 1.0 / sqrt(1.0 + x * x);
}

fn two_to_the(n: Wheels) -> Wheels {
    return bitcast<Wheels>(vec4<u32>(vec4<i32>(n) + 127i) << vec4<u32>(23u));
}

fn sine_polynomial(r: Wheels) -> Wheels {
    let t = r * r;
    let low = -0.16666657 + 8.333025e-3 * t;
    let high = -1.9807351e-4 + 2.6017497e-6 * t;
    let p = low + high * (t * t);
    return r + r * t * p;
}

fn cosine_polynomial(r: Wheels) -> Wheels {
    let t = r * r;
    var p = Wheels(-2.6284124e-7);
    p = p * t + 2.4773923e-5;
    p = p * t + -1.3888641e-3;
    p = p * t + 4.166666e-2;
    p = p * t + -0.5;
    return 1.0 + t * p;
}

fn reduce(x: Wheels, half_turns: Wheels) -> Wheels {
    return (x - half_turns * 3.140625) - half_turns * 9.676535897932385e-4;
}

fn parity_sign(n: Wheels) -> Wheels {
    let half = n * 0.5;
    return 1.0 - (half - floor(half)) * 4.0;
}

fn own_sin(x: Wheels) -> Wheels {
    let n = floor(x * 0.3183098861837907 + 0.5);
    return parity_sign(n) * sine_polynomial(reduce(x, n));
}

fn own_cos(x: Wheels) -> Wheels {
    let n = floor(x * 0.3183098861837907);
    return -(parity_sign(n) * sine_polynomial(reduce(x, n + 0.5)));
}

fn own_tan(x: Wheels) -> Wheels {
    let n = floor(x * 0.3183098861837907 + 0.5);
    let r = reduce(x, n);
    return sine_polynomial(r) / cosine_polynomial(r);
}

fn own_atan(x: Wheels) -> Wheels {
    let size = abs(x);
    let large = Wheels(1.0) < size;
    let q = select(size, Wheels(1.0), large) / select(Wheels(1.0), size, large);
    let t = q * q;
    let t2 = t * t;
    let t4 = t2 * t2;
    let p01 = -0.33333072 + 0.1999262 * t;
    let p23 = -0.14203644 + 0.10640934 * t;
    let p45 = -7.504295e-2 + 4.2691525e-2 * t;
    let p67 = -1.6068634e-2 + 2.8498906e-3 * t;
    let p = (p01 + p23 * t2) + (p45 + p67 * t2) * t4;
    let angle = q + q * t * p;
    let folded = select(angle, 1.5707963267948966 - angle, large);
    return select(folded, -folded, x < Wheels(0.0));
}

fn own_exp(argument: Wheels) -> Wheels {
    let x = min(max(argument, Wheels(-87.0)), Wheels(88.0));
    let n = floor(x * 1.4426950408889634 + 0.5);
    let r = (x - n * 0.693359375) - n * -2.1219444e-4;
    var p = Wheels(1.3836839e-3);
    p = p * r + 8.374822e-3;
    p = p * r + 4.1668225e-2;
    p = p * r + 0.1666642;
    p = p * r + 0.4999999;
    return (r * r * p + (r + 1.0)) * two_to_the(n);
}
