// All wheels of a car at once. Figures of a wheel are vectors of FL, FR, RL and RR.

alias Wheels = vec4<f32>;
alias WheelBits = vec4<u32>;
