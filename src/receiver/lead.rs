//! The component of a signal that a receiver searches and follows.

use crate::correlate::fits;
use gnss::signal::{self, Component, Layers, Shape, Signal};

/// The strongest component whose code is short enough to be made; of equally strong ones a pilot.
///
/// A pilot with a secondary code costs the search no more than data do: both change sign from period to
/// period.
pub fn lead(signal: &'static Signal) -> Option<&'static Component> {
    let rank = |component: &&Component| {
        let is_pilot = component.message.is_none();
        (component.power_share, is_pilot, is_pilot && component.secondary_code.periods() > 1)
    };
    let possible = signal.components.iter().filter(|component| fits(component));
    possible.rev().max_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal))
}

/// The component whose data can be read once the secondary code of `pilot` is aligned: their codes have the
/// same length, symbols and secondary code of the data begin where the pilot's secondary code does, and both
/// are on the same sideband of a sub-carrier where they have one.
pub fn beside(pilot: &'static Component, signal: &'static Signal) -> Option<&'static Component> {
    let side = pilot.tone().map(|tone| tone.half_cycles);
    let fits = |component: &&Component| {
        let periods = component.periods_per_symbol().unwrap_or(0);
        let whole = |periods: u32| pilot.secondary_code.periods().is_multiple_of(periods.max(1));
        let same = (component.period_s() / pilot.period_s() - 1.0).abs() < 1e-12;
        let on_side = component.tone().map(|tone| tone.half_cycles) == side;
        periods > 0 && same && whole(periods) && whole(component.secondary_code.periods()) && on_side
    };
    signal.components.iter().find(|component| !std::ptr::eq(*component, pilot) && fits(component))
}

/// The pilot on the other sideband of the sub-carrier of which `pilot` is one, as strong and with a
/// secondary code as long: both are followed together once the secondary code is aligned.
pub fn other_side(pilot: &Component, signal: &'static Signal) -> Option<&'static Component> {
    let tone = pilot.tone().filter(|_| pilot.message.is_none() && pilot.secondary_code.periods() > 1)?;
    let is_other = |other: &&Component| {
        let like = |of: fn(&Component) -> (f64, f64, f64)| of(pilot) == of(other);
        other.message.is_none()
            && like(|one| (one.power_share, one.phase_cycles, one.chip_rate_hz))
            && (pilot.code_chips, pilot.secondary_code.periods()) == (other.code_chips, other.secondary_code.periods())
            && other.tone().is_some_and(|other| other.is_opposite(&tone))
    };
    signal.components.iter().find(is_other)
}

/// Ratio of the C/N0 of both sidebands to that of one.
pub const BOTH_SIDES: f64 = 2.0;

/// The pilot whose code begins with that of `lead` and is whole periods of it long: too long to be searched
/// for, but found once `lead` is followed.
pub fn long_beside(lead: &'static Component, signal: &'static Signal) -> Option<&'static Component> {
    let is_long = |pilot: &&Component| {
        let plain = pilot.message.is_none() && pilot.secondary_code.periods() == 1 && pilot.layers.len() == 1;
        let in_step = pilot.chip_rate_hz == lead.chip_rate_hz && pilot.phase_cycles == lead.phase_cycles;
        let of_one_step = pilot.steps_per_chip() == 1 && lead.steps_per_chip() == 1;
        let segments = pilot.code_chips.checked_div(lead.code_chips).unwrap_or(0);
        let whole = pilot.code_chips == segments * lead.code_chips
            && segments.is_multiple_of(lead.periods_per_symbol().unwrap_or(1));
        plain && in_step && of_one_step && segments > 1 && whole
    };
    signal.components.iter().find(|pilot| lead.secondary_code.periods() == 1 && is_long(pilot))
}

/// Correlation of a component with the replica that is made of it, and of the replica with itself. Of one
/// sideband of a sub-carrier that of the chips alone: what a tone beside the carrier finds of them.
pub fn shapes(component: &Component, made: Layers) -> Option<[Shape; 2]> {
    let strongest = component.strongest()?;
    if let Some(tone) = component.tone() {
        return Some(tone.shapes(component.chip_rate_hz));
    }
    Some(match made {
        Layers::Strongest => component.shapes_by(Layers::Whole, strongest),
        Layers::Whole => [component.shape(), component.shape()],
    })
}

/// Power that the replica finds, over the component's.
pub fn efficiency(signal: &Shape, own: &Shape) -> f64 {
    let found = signal.correlation(0.0);
    found * found / own.correlation(0.0)
}

/// C/N0 of what the receiver follows of a signal over that of the whole signal, in decibels: the component's
/// share of the power, less what its replica does not have.
pub fn followed_db(component: &Component, made: Layers) -> f64 {
    let efficiency = shapes(component, made).map_or(1.0, |[signal, own]| efficiency(&signal, &own));
    10.0 * libm::log10(component.power_share * efficiency)
}

/// Reason why this receiver cannot follow a signal to a position, if it cannot.
pub fn refusal(signal: &'static Signal) -> Option<String> {
    if signal.components.iter().all(|component| component.message.is_none()) {
        return Some("no message of it is known".to_owned());
    }
    let Some(component) = lead(signal) else {
        return Some("none of its codes has fewer than 65 536 steps a period".to_owned());
    };
    if component.message.is_some() && component.secondary_code.periods() > 1 {
        return Some("its data have a secondary code, and no pilot beside them shows where it begins".to_owned());
    }
    if component.message.is_none() && component.secondary_code.periods() == 1 {
        return Some("its pilot has no secondary code that shows where the data beside it begin".to_owned());
    }
    let unread = component.message.is_none() && beside(component, signal).is_none();
    unread.then(|| "its data do not begin where the secondary code of its pilot does".to_owned())
}

/// The first of some signals that cannot be dated by the others, and why.
pub fn undated(signals: &[&'static Signal]) -> Option<(&'static Signal, String)> {
    let has_data = |signal: &Signal| signal.components.iter().any(|component| component.message.is_some());
    let alone = |signal: &&'static Signal| {
        has_data(signal) && !signal.is_dated() && signal.dated_by(signals.iter().copied()).next().is_none()
    };
    let signal = signals.iter().copied().find(alone)?;
    let names: Vec<&str> = signal.dated_by(signal::all()).map(|other| other.name).collect();
    let names = names.join(" or ");
    let reason = format!("its message says neither time nor orbit: expected {names} beside it, which says both");
    Some((signal, reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::galileo::e5::{E5A, E5B};
    use gnss::galileo::e6::E6;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::SecondaryCode;
    use gnss::signal::synthetic::{LONG_BOC, MIXED, MULTIPLEXED, MULTIPLEXED_DATA, QUADRATURE, QUADRATURE_DATA};

    #[test]
    fn the_strongest_component_that_can_be_made_leads_and_pilots_go_first() {
        let index = |signal: &'static Signal| {
            let lead = lead(signal).unwrap();
            signal.components.iter().position(|component| std::ptr::eq(component, lead)).unwrap()
        };
        // Of D the code of 1 534 500 chips is found later; B's components differ by their data alone.
        let found = [&L1_CA, &LONG_BOC, &QUADRATURE, &QUADRATURE_DATA, &MIXED, &MULTIPLEXED].map(index);
        assert_eq!(found, [0, 1, 0, 1, 0, 0]);
        let long = |signal: &'static Signal| long_beside(lead(signal).unwrap(), signal);
        assert!(long(&MULTIPLEXED).is_some_and(|pilot| std::ptr::eq(pilot, &MULTIPLEXED.components[1])));
        assert!([&L1_CA, &LONG_BOC, &QUADRATURE, &QUADRATURE_DATA, &MIXED].map(long).iter().all(Option::is_none));
    }

    #[test]
    fn what_says_no_time_is_refused_without_a_signal_that_gives_it() {
        let (signal, reason) = undated(&[&E6, &L1_CA]).unwrap();
        assert!(*signal == E6 && reason.contains("Galileo E1 or Galileo E5b"), "{reason}");
        // F/NAV has no delay that would make its clock that of E6.
        assert!(undated(&[&E6, &E5A]).is_some());
        for dated in [&[&E1, &E6][..], &[&E6, &E5B], &[&L1_CA, &E5A], &[&MIXED]] {
            assert_eq!(undated(dated), None, "{dated:?}");
        }
    }

    #[test]
    fn what_cannot_be_followed_to_a_position_is_refused_with_its_reason() {
        assert_eq!(refusal(&L1_CA), None);
        for signal in [&QUADRATURE, &MIXED, &MULTIPLEXED] {
            assert!(refusal(signal).unwrap().contains("no message"), "{signal}");
        }
        // In a time of its own, with a message that begins where the secondary code does.
        assert_eq!(refusal(&LONG_BOC), None);
        // With a message that begins where the secondary codes do it can be received.
        assert_eq!(refusal(&QUADRATURE_DATA), None);
        assert_eq!(refusal(&MULTIPLEXED_DATA), None);
        static OVERLAID: Signal = Signal {
            name: "overlaid",
            components: &[Component { secondary_code: SecondaryCode::Shared(&[1, -1]), ..L1_CA.components[0] }],
            ..L1_CA
        };
        assert!(refusal(&OVERLAID).unwrap().contains("have a secondary code"));
    }
}
