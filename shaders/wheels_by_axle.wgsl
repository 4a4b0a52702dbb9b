// The wheels of one axle at once, left and right, and the axles one after the other.

alias Wheels = vec2<f32>;
alias WheelBits = vec2<u32>;
