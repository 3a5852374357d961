//! Laws of `[osnma]` as written.

use super::*;
use crate::scenario::Spoofed;
use ::osnma::chain::{Hash, MacFunction};
use ::osnma::provider::Change;

#[test]
fn authentication_arrives_as_written_and_is_absent_without_its_table() {
    let scenario = parse(&(full() + HOSTILE)).unwrap();
    let spec = scenario.osnma.unwrap();
    assert_eq!((spec.hash, spec.mac, spec.table), (Hash::Sha3, MacFunction::CmacAes, 33));
    assert_eq!((spec.is_operational, spec.without.into_iter().collect::<Vec<_>>()), (false, vec![5]));
    assert_eq!((spec.key_turn_s, spec.step_s, spec.transitions), ([900.0, 60.0], 300.0, vec![(Change::Alert, 600.0)]));
    assert_eq!((scenario.spoofers[0].replay_s, scenario.spoofers[0].osnma), (40.0, Spoofed::OwnKeys));
    let plain = parse(&format!("{MINIMAL}{STATIC}[[spoofer]]\npower_db = 6\n")).unwrap();
    assert_eq!((plain.osnma, plain.spoofers[0].osnma, plain.spoofers[0].replay_s), (None, Spoofed::True, 0.0));
}

#[test]
fn authentication_that_cannot_be_is_refused_with_its_reason() {
    let galileo =
        format!("{MINIMAL}signals = [\"Galileo E1\"]\n{STATIC}").replace("2010-07-01T10:00:00", "2020-11-29T12:00:00");
    let read = |more: &str| parse(&format!("{galileo}{more}")).err().map(|error| error.to_string());
    let composed = |text: &str| parse(text).unwrap().scene().err().map(|error| error.to_string()).unwrap_or_default();
    let refused = |more: &str, part: &str| {
        let said = read(more).unwrap_or_else(|| composed(&format!("{galileo}{more}")));
        assert!(said.contains(part), "{more}: {said}");
    };
    refused("[osnma]\nwithout = [\"G05\"]\n", "osnma.without");
    refused("[osnma]\nstep_s = 121\n", "a multiple of 30 s");
    refused("[osnma]\npublic_key_for_s = 900\n", "at most 600 s");
    refused("[osnma]\nmaclt = 28\n", "expected 27, 33, 34 or 35");
    let change = |kind: &str, time_s: u32| format!("[[osnma.transition]]\nkind = \"{kind}\"\ntime_s = {time_s}\n");
    refused(&(change("alert", 60) + &change("alert", 9000)), "follows an alert");
    refused(&(change("chain_revoked", 60) + &change("end_of_chain", 660)), "before the one before it has ended");
    let four: String = (0..4).map(|number| change("end_of_chain", 3000 * number)).collect();
    refused(&four, "at most 3");
    refused("[[spoofer]]\npower_db = 6\nosnma = \"none\"\n", "there is no [osnma]");
    let said = composed(&format!("{MINIMAL}{STATIC}[osnma]\n"));
    assert!(said.contains("add \"Galileo E1\" to signals"), "{said}");
}
