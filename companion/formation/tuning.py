"""Every constant of the distributed rules, with its unit and its reason, derived from the mission where it can be."""

from __future__ import annotations

from dataclasses import dataclass

from companion.mission import Mission


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Constants of rules 1 to 6; `derive` gives those of a mission."""

    # Rule 1: who is there.
    age_limit_s: float = 1.0  # a track unseen for longer is no vehicle in sight
    duplicate_m: float  # two tracks nearer than this are one hull: two hulls would touch
    sigma_limit_m: float  # a larger or unknown position error counts as this, so that margins stay under the spacing

    # Rule 2: who is dead.
    dead_window_s: float = 5.0  # long enough for a circling hull to get clear of its wake point
    dead_speed_mps: float  # through water; a drifting hull has none, a circling one steerage speed

    # Rule 3: which points are taken.
    occupied_m: float  # a vehicle this near to a point has it, however wrong the own position may be
    empty_looks: int = 3  # looks in a row that must find a point empty, since one detection may drop out
    near_sigmas: float = 2.0  # added to a distance within which something counts as near
    sight_sigmas: float = 3.0  # taken off the sensing range: what is nearer is seen for sure
    aside_m: float = 0.3  # so is this, which a vehicle on a point may lie beyond it
    circling_m: float  # taken off the range too where a vehicle may be on the far side of its circle

    # Rule 4: which places there are.
    top_speed_mps: float  # who was on a point can be no further from it than this allows
    spacing_m: float  # between the places of the reserve, and from the formation to them

    # Rule 5: what a point costs.
    exponent: float  # p of d^p: 1 for least travel, 2 for most even
    hysteresis_m: float = 0.3  # a point must be this much better to be worth turning round for ...
    hysteresis_beyond_m: float  # ... while the own one is still this far
    parked_m: float  # a vehicle this near to a point stays, unless all can see why it should not ...
    parked_share: float = 0.2  # ... and pays for this share of its way to it, wherever on its circle it is
    switches_allowed: float = 8.0  # changes of mind, beyond which ...
    switch_leak_s: float = 10.0  # (one is forgiven each time this passes)
    calm_s: float = 20.0  # ... far points all cost the same for so long: ends a livelock

    # The clock.
    step_m: float  # lambda: a point that moved further between two ticks did not move, the clock did
    settle_s: float = 1.0  # after a jump the clock must run on evenly for so long

    @staticmethod
    def derive(mission: Mission) -> Tuning:
        """The constants of a mission; its waiting radius is 0 for vehicles that can stand still."""
        spacing = mission.nearest_m()
        limits = mission.limits
        circling_m = limits.waiting_radius_m
        return Tuning(
            duplicate_m=limits.safe_distance_m / 4.0,
            sigma_limit_m=spacing / 20.0,
            dead_speed_mps=min(0.15 * limits.top_speed_mps, 0.5 * limits.steerage_speed_mps),
            occupied_m=0.4 * spacing,
            circling_m=circling_m,
            top_speed_mps=limits.top_speed_mps,
            spacing_m=spacing,
            exponent=mission.formation.exponent,
            hysteresis_beyond_m=spacing / 2.0,
            parked_m=min(circling_m + 0.7, 0.5 * spacing),
            step_m=mission.path.step_m,
        )
