// Effort as a direction and a density of pulses: |effort| / 2^FULL_SCALE_BITS of the time on.
module effort_output #(
    parameter FULL_SCALE_BITS = 15
) (
    input  wire               clock,
    input  wire               gate,      // low: no pulse, at once
    input  wire               take_over, // let `effort` come into force
    input  wire signed [15:0] effort,
    input  wire        [14:0] limit,     // of its magnitude
    output wire               pulse,
    output reg                negative
);
    localparam [15:0] FULL_SCALE = 16'd1 << FULL_SCALE_BITS;
    wire [15:0] bound = {1'b0, limit} < FULL_SCALE ? {1'b0, limit} : FULL_SCALE;
    wire [15:0] magnitude = effort[15] ? -effort : effort;
    reg  [15:0] in_force;
    // First-order sigma-delta: the highest bit is the pulse, the others are what is still due.
    reg  [FULL_SCALE_BITS:0] sum;

    assign pulse = gate && sum[FULL_SCALE_BITS];

    always @(posedge clock)
        if (!gate) begin
            in_force <= 0;
            negative <= 0;
            sum <= 0;
        end else begin
            if (take_over) begin
                in_force <= magnitude < bound ? magnitude : bound;
                negative <= effort[15];
            end
            sum <= {1'b0, sum[FULL_SCALE_BITS-1:0]} + in_force[FULL_SCALE_BITS:0];
        end
endmodule
