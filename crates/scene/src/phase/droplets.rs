//! Water droplets' phase function by diameter [Jendersie23].

use super::Blend;

/// The mixture that fits Mie's phase function of droplets of a diameter d [µm] in visible light: for d ≥ 5
/// [Jendersie23, (7)–(10)], for smaller ones the same paper's supplement, (11)–(22).
pub fn fit(d: f64) -> Blend {
    let ln = d.ln();
    if d >= 5.0 {
        Blend {
            g_hg: (-0.0990567 / (d - 1.67154)).exp(),
            g_d: (-2.20679 / (d + 3.91029) - 0.428934).exp(),
            alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
            w_d: (-0.599085 / (d - 0.641583) - 0.665888).exp(),
        }
    } else if d >= 1.5 {
        Blend {
            g_hg: 0.0604931 * ln.ln() + 0.940256,
            g_d: 0.500411 - 0.081287 / (-2.0 * ln + ln.tan() + 1.27551),
            alpha: 7.30354 * ln + 6.31675,
            w_d: 0.026914 * (ln - (5.68947 * (ln.ln() - 0.0292149)).cos()) + 0.376475,
        }
    } else if d > 0.1 {
        let inner = (ln - 0.238604) * (ln + 1.00667) / (0.507522 - 0.15677 * ln);
        Blend {
            g_hg: 0.862 - 0.143 * ln * ln,
            g_d: 0.379685 * (1.19692 * inner.cos() + 1.37932 * ln + 0.0625835).cos() + 0.344213,
            alpha: 250.0,
            w_d: 0.146209 * (3.38707 * ln + 2.11193).cos() + 0.316072 + 0.0778917 * ln,
        }
    } else {
        Blend {
            g_hg: 13.8 * d * d,
            g_d: 1.1456 * d * (9.29044 * d).sin(),
            alpha: 250.0,
            w_d: 0.252977 - 312.983 * d.powf(4.3),
        }
    }
}
