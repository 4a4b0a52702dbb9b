// Twin of `src/scalar/elementary.rs`: sine, cosine, tangent, inverse tangent and exponential of known accuracy, because WGSL only
// promises 2^-11 for `sin` and `cos` and 4096 ULP for `atan`. Same functions, same order, same operations. Drivers may regroup
// literals, so no product has more than one.
//
// They work on several figures side by side, one per wheel: on `Wheels`, which a kernel's list of fragments defines. Polynomials
// are long chains of dependent operations, and several chains hide each other's latency, as `Pair` in `src/scalar/pair.rs` does on
// the processor. `_each` computes two functions of the wheels in lockstep for the same reason. A single function is half of that;
// every compiler sees that both halves are the same. Compilers may serialise the chains to save registers, so the longest
// polynomials are also split by powers of the square into independent halves.

struct WheelsPair {
    first: Wheels,
    second: Wheels,
}

// Whether `x` is a number, by its exponent: a driver may assume away comparisons that ask for NaN.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// -1 below zero, else +1, and `1 / cos(atan x)`: twins of the provided methods of `Real` in `src/scalar/mod.rs`.
fn sign_of(x: Wheels) -> Wheels {
    return select(Wheels(1.0), Wheels(-1.0), x < Wheels(0.0));
}

fn sec_atan(x: Wheels) -> Wheels {
    return sqrt(1.0 + x * x);
}

// Added to a whole number below 2^22, leaves that number in the low bits: `WHOLE` in `src/scalar/float.rs`. This is cheaper than
// a conversion to integers, whose range WGSL has to check.
const WHOLE: f32 = 12582912.0;
const WHOLE_AND_BIAS: f32 = 12583039.0;

fn negate_where_odd(x: Wheels, n: Wheels) -> Wheels {
    return bitcast<Wheels>(bitcast<WheelBits>(x) ^ (bitcast<WheelBits>(n + WHOLE) << WheelBits(31u)));
}

fn with_sign_of(x: Wheels, other: Wheels) -> Wheels {
    let sign = bitcast<WheelBits>(other) & WheelBits(0x80000000u);
    return bitcast<Wheels>((bitcast<WheelBits>(x) & WheelBits(0x7fffffffu)) | sign);
}

fn two_to_the(n: Wheels) -> Wheels {
    return bitcast<Wheels>(bitcast<WheelBits>(n + WHOLE_AND_BIAS) << WheelBits(23u));
}

fn sine_polynomial(r: Wheels) -> Wheels {
    let t = r * r;
    var p = Wheels(2.6060957e-6);
    p = p * t + -1.9809777e-4;
    p = p * t + 8.333069e-3;
    p = p * t + -0.1666666;
    return r + r * (p * t);
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

fn sine_pi_polynomial_each(x: Wheels, y: Wheels) -> WheelsPair {
    let t = x * x;
    let u = y * y;
    let tt = t * t;
    let uu = u * u;
    let p = (t * 2.5502698 + -5.167721) + tt * (t * 7.9835765e-2 + -0.59943736);
    let q = (u * 2.5502698 + -5.167721) + uu * (u * 7.9835765e-2 + -0.59943736);
    return WheelsPair(x * (p * t + 3.141592653589793), y * (q * u + 3.141592653589793));
}

fn reduce(x: Wheels, half_turns: Wheels) -> Wheels {
    return (x - half_turns * 3.140625) - half_turns * 9.676535897932385e-4;
}

fn own_sin(x: Wheels) -> Wheels {
    let n = round(x * 0.3183098861837907);
    return negate_where_odd(sine_polynomial(reduce(x, n)), n);
}

fn own_cos(x: Wheels) -> Wheels {
    let n = round(x * 0.3183098861837907 - 0.5);
    return negate_where_odd(sine_polynomial(-reduce(x, n + 0.5)), n);
}

fn own_tan_each(x: Wheels, y: Wheels) -> WheelsPair {
    let n = round(x * 0.3183098861837907);
    let m = round(y * 0.3183098861837907);
    let r = reduce(x, n);
    let s = reduce(y, m);
    return WheelsPair(sine_polynomial(r) / cosine_polynomial(r), sine_polynomial(s) / cosine_polynomial(s));
}

fn own_tan(x: Wheels) -> Wheels {
    return own_tan_each(x, x).first;
}

fn own_sin_pi_each(x: Wheels, y: Wheels) -> WheelsPair {
    let n = round(x);
    let m = round(y);
    let sines = sine_pi_polynomial_each(x - n, y - m);
    return WheelsPair(negate_where_odd(sines.first, n), negate_where_odd(sines.second, m));
}

fn own_sin_pi(x: Wheels) -> Wheels {
    return own_sin_pi_each(x, x).first;
}

fn own_cos_pi_each(x: Wheels, y: Wheels) -> WheelsPair {
    let n = round(x - 0.5);
    let m = round(y - 0.5);
    let sines = sine_pi_polynomial_each((n + 0.5) - x, (m + 0.5) - y);
    return WheelsPair(negate_where_odd(sines.first, n), negate_where_odd(sines.second, m));
}

fn own_cos_pi(x: Wheels) -> Wheels {
    return own_cos_pi_each(x, x).first;
}

fn own_atan_each(x: Wheels, y: Wheels) -> WheelsPair {
    let large_x = Wheels(1.0) < abs(x);
    let large_y = Wheels(1.0) < abs(y);
    let a = select(x, 1.0 / x, large_x);
    let b = select(y, 1.0 / y, large_y);
    let t = a * a;
    let u = b * b;
    let tt = t * t;
    let uu = u * u;
    let high_x = (t * 4.320277e-2 + -7.5516604e-2) + tt * (t * 2.9168893e-3 + -1.6358716e-2);
    let high_y = (u * 4.320277e-2 + -7.5516604e-2) + uu * (u * 2.9168893e-3 + -1.6358716e-2);
    let low_x = (t * 0.19993767 + -0.33333153) + tt * (t * 0.10665769 + -0.14211002);
    let low_y = (u * 0.19993767 + -0.33333153) + uu * (u * 0.10665769 + -0.14211002);
    let angle_x = a * ((low_x + (tt * tt) * high_x) * t + 1.0);
    let angle_y = b * ((low_y + (uu * uu) * high_y) * u + 1.0);
    let quarter_x = with_sign_of(Wheels(1.5707963267948966), x);
    let quarter_y = with_sign_of(Wheels(1.5707963267948966), y);
    return WheelsPair(
        select(angle_x, quarter_x - angle_x, large_x),
        select(angle_y, quarter_y - angle_y, large_y),
    );
}

fn own_atan(x: Wheels) -> Wheels {
    return own_atan_each(x, x).first;
}

fn own_exp(argument: Wheels) -> Wheels {
    let x = min(max(argument, Wheels(-87.0)), Wheels(88.0));
    let n = round(x * 1.4426950408889634);
    let r = (x - n * 0.693359375) - n * -2.1219444e-4;
    var p = Wheels(1.3836839e-3);
    p = p * r + 8.374822e-3;
    p = p * r + 4.1668225e-2;
    p = p * r + 0.1666642;
    p = p * r + 0.4999999;
    return (r * r * p + (r + 1.0)) * two_to_the(n);
}

// For one figure; the functions above are for wheels.
fn own_ln(x: f32) -> f32 {
    let offset = bitcast<u32>(x) - 0x3f3504f3u;
    let exponent = f32(bitcast<i32>(offset) >> 23u);
    let mantissa = bitcast<f32>((offset & 0x007fffffu) + 0x3f3504f3u);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let t = s * s;
    var p = 0.11111111;
    p = p * t + 0.14285715;
    p = p * t + 0.2;
    p = p * t + 0.33333334;
    let twice = s + s;
    let fraction = twice + twice * (p * t);
    return (fraction + exponent * -2.1219444e-4) + exponent * 0.693359375;
}

fn own_power(base: f32, exponent: f32) -> f32 {
    if base < 1e-37 { return 0.0; }
    return own_exp(Wheels(exponent * own_ln(base))).x;
}
