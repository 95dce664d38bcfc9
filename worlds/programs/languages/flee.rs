// The program of flee.c in Rust: it computes the same bits.
#[path = "../../../client_sdk/programs/rust/tessera.rs"]
mod tessera;

tessera_program!(
    "program | flee | Rolls away from a body that comes near.
motion | dynamic
parameter | from | body | 0 | 0 | 9.0072e+15 | The body that it flees; 0: none.
parameter | radius | m | 8 | 0 | 1000 | It flees what is nearer than that.
parameter | force | N | 20 | 0 | 1e6 | That it rolls with.
parameter | look | m | 1.5 | 0 | 100 | How far ahead of itself it looks for walls.
value | distance | m | 0 | How far away the body is.
value | turned | | 0 | How often a wall has turned it.
"
);

fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[no_mangle]
pub extern "C" fn ask() {
    let [from, _radius, _force, look] = tessera::parameters();
    let own = tessera::senses();
    tessera::body(from);
    // Where it rolls to, unless it is slow.
    let speed = length(own.velocity[0], own.velocity[1]);
    if speed > 0.1 {
        let ahead = [own.velocity[0] / speed, own.velocity[1] / speed, 0.0];
        tessera::cast(own.position, ahead, look, 0.0, u32::MAX);
    }
}

#[no_mangle]
pub extern "C" fn run() {
    let [_from, radius, force, _look] = tessera::parameters();
    let [_, mut turned] = tessera::values();
    let own = tessera::senses();
    if tessera::findings(0) == 0 {
        return;
    }
    let hunter = tessera::finding(0, 0);
    let mut x = own.position[0] - hunter.position[0];
    let mut y = own.position[1] - hunter.position[1];
    let distance = length(x, y);
    // The hunter may come while this body sleeps.
    tessera::wake_in(1);
    if distance < radius && distance > 0.0 {
        x /= distance;
        y /= distance;
        if tessera::findings(1) > 0 {
            // Along the wall, not into it.
            let wall = tessera::finding(1, 0);
            let into = x * wall.normal[0] + y * wall.normal[1];
            if into < 0.0 {
                x -= into * wall.normal[0];
                y -= into * wall.normal[1];
                turned += 1.0;
            }
        }
        tessera::push_awake([force * x, force * y, 0.0], [0.0; 3]);
    }
    tessera::set_values([distance, turned]);
}
