"""What is said of an explanation: verdict, location, findings and proof, each with its numbers and its sentence?"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import sqrt

from identify.chain import Chain, model_of
from identify.effects import physics_in, would_separate
from identify.effects.effect import Effect, short
from identify.explain.bench import Bench
from identify.explain.carried import bare, left_by_chance, rougher
from identify.explain.cautions import cautions
from identify.explain.confirm import adapted, held_out_rms, most_believed
from identify.explain.entered import entered
from identify.explain.explanation import (
    Explanation,
    Finding,
    HeldOut,
    Location,
    Profile,
    Range,
    Remaining,
    Residuals,
    Verdict,
)
from identify.explain.hypothesis import Hypothesis
from identify.explain.left_open import Open, left_open, named_open, told_open
from identify.explain.locate import LIKELY, doubted, located
from identify.explain.neighbours import spanning
from identify.explain.of_readings import finding as of_readings
from identify.explain.of_readings import location
from identify.explain.phrases import called, described, listed, stretch_told
from identify.explain.prove import Proof, foretells, proven
from identify.explain.readings import Readings
from identify.explain.rig_file import HeldToRigFile, held_to_rig_file
from identify.explain.rivals import odds, ordinary
from identify.explain.round import Round
from identify.explain.shape import shape_of
from identify.explain.survey import StageShare
from identify.explain.unvisited import stage_beyond, told_beyond, unvisited
from identify.explain.warrant import Warranted
from identify.explain.where import acting, profile
from identify.fit import Fit
from identify.holdout import Split
from identify.interval import Interval
from identify.model import Model
from identify.natural_units import shown, shown_interval
from identify.observe import over_noise, pooled_rms
from identify.uncertainty.inflation import inflation
from identify.unnamed.correction import UNNAMED, Correction
from identify.unnamed.linear import Filter
from identify.unnamed.timed import Moments

CHANCE = 0.5  # share of what is left on held-out data, from which it is called chance
TO_THE_NOISE = 1.1  # a held-out residual below this many times the noise counts as explained


class Answer:
    """All that the answer is written from."""

    def __init__(
        self, model: Model, data: Split, bench: Bench, plain: Hypothesis, earned: Warranted, rounds: list[Round],
        dropped: tuple[Effect, ...], readings: Readings, survey: tuple[StageShare, ...],
    ) -> None:
        """Simulate the held-out data with the plain and the better model."""
        self.model, self.data, self.bench, self.rounds, self.dropped = model, data, bench, rounds, dropped
        self.survey = survey
        self.plain, self.better, self.beyond = plain, earned.hypothesis, earned.beyond
        self.elsewhere = earned.elsewhere
        self.noise_v = data.noise.rms_v
        self.inflation = inflation(self.better.fit.chain, bench.observations, data.noise.freedom)
        self.readings = readings
        mended = bool(readings.data is not readings.raw)
        self.before = readings.before.fit.chain if mended else plain.fit.chain
        self.raw = readings.raw if mended else replace(data, train=bench.observations)
        self.before_v = held_out_rms(adapted(self.before, self.raw.test), self.raw.test)
        chain = adapted(self.better.fit.chain, data.test)
        self.named_v = held_out_rms(chain, data.test)
        self.named_over = over_noise(chain, bare(data.test))
        self.by_chance = left_by_chance(bench, self.better.effects, chain, data.test)
        self.blemished = bool(readings.found) and not self.better.effects
        asked = self.named_over > TO_THE_NOISE or self.blemished
        if asked or not self.better.effects:  # where names explain it all no place is told of what they leave
            self.beyond = doubted(bench, self.beyond)
        self.proof = proven(bench, self.beyond, data.test) if asked else None
        self.unproven = asked and self.proof is None and foretells(self.beyond)
        self.after_v = self.proof.held_out_v if self.proof else self.named_v
        self.improved = self.proof.hypothesis if self.proof else self.better
        self.left_open = self._left_open()
        self.unvisited = self._unvisited() if self.left_open is None else None
        self.entered = entered(self.beyond, self.unproven)

    @cached_property
    def rig_file(self) -> HeldToRigFile:
        """Return what the rig file's values leave, and those that the recordings say are others."""
        return held_to_rig_file(self.bench.plain, self.improved.fit, self.bench.observations, self.inflation)

    def _left_open(self) -> tuple[Open, ...] | None:
        """Return the values that fitted runs leave open, where nothing else is left of those held out."""
        if self.beyond.significant or self.proof is not None or self.after_v <= TO_THE_NOISE * self.noise_v:
            return None
        return left_open(self.bench, self.better, self.data.test, self.data.noise.freedom)

    def _unvisited(self) -> Range | None:
        """Return where held-out runs leave more than noise because no run that was fitted has been there."""
        chain, train = self.improved.fit.chain, self.bench.observations
        fits = over_noise(chain, train) <= TO_THE_NOISE
        return unvisited(chain, train, self.data.test) if fits and self.after_v > TO_THE_NOISE * self.noise_v else None

    @property
    def verdict(self) -> Verdict:
        """Return one of the four verdicts."""
        if self.better.effects or any(blemish.id != UNNAMED for blemish in self.readings.found):
            rest = self.leaves or (not self.better.effects and self.proof is not None)
            return "explained" if self.named_over <= TO_THE_NOISE and not rest else "partly_explained"
        met = self.after_v > TO_THE_NOISE * self.noise_v and self.left_open is None
        return "unexplained" if self.readings.found or self.beyond.significant or met else "consistent"

    @property
    def leaves(self) -> bool:
        """Return whether blemishes alone leave what noise cannot make, though held-out data bear no correction out."""
        return self.blemished and self.proof is None and self.beyond.significant and self.better.proven > 0.0

    def explanation(self) -> Explanation:
        """Return the answer."""
        chain = self.improved.fit.chain
        model = replace(model_of(chain, self.model), noise_v=self.noise_v, physics=physics_in(chain))
        findings = (
            *(self.finding(effect) for effect in self.better.effects),
            *(of_readings(b, self.blemished and self.proof is not None) for b in self.readings.found),
        )
        train, runs = self.bench.observations, tuple(o.trace.name for o in self.data.test)
        before = pooled_rms([o.used_residual(self.before) for o in self.raw.train])
        after = pooled_rms([o.used_residual(chain) for o in train])
        return Explanation(
            verdict=self.verdict, sentence=self.sentence(findings), noise=self.data.noise, mismatch_v=before,
            p_value=self.p_value, location=self.location(findings),
            effects=(*findings, *([self.unnamed(self.proof)] if self.proof else [])),
            training=Residuals(before, after),
            held_out=HeldOut(runs, self.data.how, Residuals(self.before_v, self.after_v), self.named_v),
            remaining=self.remaining(), model=model, plain=self.plain.fit, improved=self.improved.fit,
            train=train, test=self.data.test, profiles=self.profiles(), survey=self.survey,
            warnings=tuple(
                cautions(self.model, self.bench, self.plain, self.better, self.dropped, self.data, self.verdict)
            ), rig_file=self.rig_file, entered=self.entered if self.proof or not findings else (),
        )  # fmt: skip

    @property
    def p_value(self) -> float:
        """Return how likely noise alone would make the mismatch; zero once physics was found in it."""
        if self.better.effects:
            return 0.0
        return min([self.beyond.p_value, *(blemish.p_value for blemish in self.readings.found)])

    def without(self, effect: Effect) -> Chain:
        """Return the better model's chain less one effect, all other values as they are."""
        rest = tuple(e for e in self.better.effects if e is not effect)
        return self.bench.with_effects(rest, self.better.fit.chain.values)

    def finding(self, effect: Effect) -> Finding:
        """Return what is said of one effect."""
        probability, others = odds(self.bench, self.better, effect, self.rounds, self.beyond)
        left = sqrt(max(self.named_over**2 - self.by_chance, 0.0))
        elsewhere = self.unvisited or self.left_open is not None
        most = 1.0 if elsewhere else most_believed(self.before_v / self.noise_v, left)
        if probability > most:
            others = tuple(replace(o, probability=o.probability * most / probability) for o in others)
            probability = most
        parameters = self.parameters(effect)
        values = listed([f"{name} {shown_interval(interval, unit)}" for name, (interval, unit) in parameters.items()])
        told = [would_separate(effect.id, effect.place.label, o.id, o.stage) for o in others]
        told += [c.would_separate for c in effect.confused_with]
        return Finding(
            effect.id, effect.place.label, effect.form, probability, parameters, effect.equation,
            effect.sentence.format(values), others, next(filter(None, told), None),
        )  # fmt: skip

    def parameters(self, effect: Effect) -> dict[str, tuple[Interval, str]]:
        """Return an effect's shared parameters with intervals and units, by short name."""
        found = {}
        for p in effect.parameters():
            if not p.local:
                wider = self.inflation * rougher(self.bench, self.better, effect, p.name)
                interval = spanning(p.name, wider, self.better.fit, self.elsewhere)
                found[short(p.name)] = (interval, p.unit)
        return found

    def location(self, findings: Sequence[Finding]) -> Location | None:
        """Return the stage at which the mismatch enters and the stretch of its coordinate that holds it."""
        if self.better.effects:
            return self._location_of_effects(findings[0])
        if self.readings.found and self.proof is None:
            return location(self.readings.found, self.data)
        return self._location_of_correction() if self.beyond.significant else None

    def _location_of_effects(self, first: Finding) -> Location:
        """Return where the effects act, and the stage at which the names for the first one together are likeliest."""
        train, chain = self.bench.observations, self.better.fit.chain
        ranges = {e: acting(e.along, e.shows_at, chain, self.without(e), train) for e in self.better.effects}
        likely = first.stages
        stage = next(iter(likely))
        likely = self._company(self.better.effects[0]) | likely
        alike = [place.label for place in self.better.effects[0].same_at]
        same = tuple(place for place in alike if place != stage) if stage in alike else ()
        others = tuple(place for place, p in likely.items() if p > LIKELY and place not in (stage, *same))
        also = f"; at {listed(same)} the same law would give exactly the same data" if same else ""
        also += f"; what else it could be lies at {listed(others)}" if others else ""
        lines = [
            f"{e.place.label}, where {e.title} acts at {found[0].axis} {listed([stretch_told(r) for r in found])}"
            for e, found in ranges.items()
        ]
        every = tuple(r for found in ranges.values() for r in found)
        told = f"The mismatch enters at {'; and at '.join(lines)}{also}."
        return Location(stage, every, told, (*same, *others), same)

    def _company(self, effect: Effect) -> dict[str, float]:
        """Return how likely every stage is to have what is in no catalogue, where that does as an effect does."""
        if not ordinary(self.bench, self.better, effect):
            return {}
        alone = len(self.better.effects) == 1
        without = self.plain if alone else self.bench.without(self.better, effect)
        return {place.label: p for place, p in located(self.bench, without).places.items()}

    def _location_of_correction(self) -> Location:
        correction, fitted = self.beyond.fitted[0]
        base = self.beyond.base.fit.chain
        others = tuple(place.label for place in self.beyond.alternatives(self.unproven))
        acts = (correction.axis, correction.place, fitted.fit.chain, base, self.bench.observations)
        ranges = () if correction.axis == "branch" else acting(*acts)
        same = tuple(contender.stage for contender in self.entered if contender.exact)
        near = [place for place in others if place not in same]
        also = f"; at {listed(same)} it would give exactly the same data" if same else ""
        also += f"; a correction at {listed(near)} would do nearly as well" if near else ""
        also = "; where the rest of it enters is open" if self.beyond.astray else also
        also = "; held-out runs are no better for it, so where the mismatch enters is open" if self.unproven else also
        return Location(self.beyond.place.label, ranges, f"{described(self.beyond)}{also}.", others, same)

    def unnamed(self, proof: Proof) -> Finding:
        """Return the finding without a name: where it is, what it looks like, how much it would help."""
        correction, fit = proof.correction, proof.hypothesis.fit
        beside = "Beside what is named, " if self.better.effects else ""
        here = (1.0 - self.beyond.p_value) * self.beyond.places.get(self.beyond.place, 1.0)
        return Finding(
            UNNAMED, self.beyond.place.label, correction.form, here, self.weights(correction, fit), correction.equation,
            f"{beside}{described(self.beyond)}; on held-out data it lowers the residual from "
            f"{shown(self.named_v, 'V', 3)} to {shown(proof.held_out_v, 'V', 3)}. No physics in the catalogue explains "
            "this shape.",
            (), None, shape_of(correction, fit, self.bench.observations),
        )  # fmt: skip

    def weights(self, correction: Correction, fit: Fit) -> dict[str, tuple[Interval, str]]:
        """Return the weights of a correction that no curve shows, with intervals and units, by short name."""
        if correction.curved or correction.local or isinstance(correction, Filter):
            return {}
        return {
            short(p.name): (Interval(fit.chain.values[p.name], *fit.ci95(p.name, self.inflation)), p.unit)
            for p in correction.parameters()
        }  # fmt: skip

    def remaining(self) -> Remaining:
        """Return what the better model leaves on held-out data."""
        over = self.after_v / self.noise_v
        if self.left_open or self.unvisited is not None:
            return self._remaining_unfitted(over)
        if self.by_chance > CHANCE * (over**2 - 1.0) > 0.0 and not self.beyond.significant:
            return Remaining(over, None, "What is left is what the named noise does by chance: it differs in every "
                             "repeat, so no model can predict it.")  # fmt: skip
        if not self.beyond.significant or (self.blemished and self.proof is None and not self.leaves):
            return Remaining(over, None, "Nothing that any correction could explain is left beyond the noise.")
        if self.proof is not None:
            stage = self.beyond.place.label
            all_of_it = self.after_v <= TO_THE_NOISE * self.noise_v
            with_it = "nothing is left beyond the noise" if all_of_it else f"{over:.3g} times the noise is left"
            return Remaining(over, stage, f"With the unnamed law in the model {with_it}; what it is stays open.")
        if not self.better.effects and not self.blemished:
            where = "where it enters is open" if self.unproven else "it is located above"
            return Remaining(over, self.beyond.place.label, f"The mismatch is not explained; {where}.")
        return Remaining(over, self.beyond.place.label, f"{described(self.beyond)}.")

    def _remaining_unfitted(self, over: float) -> Remaining:
        """Return what is left because the runs that were fitted do not tell it: values, or what acts beyond them."""
        if self.unvisited is not None:
            return Remaining(over, stage_beyond(self.unvisited), told_beyond(self.unvisited))
        return Remaining(over, None, told_open(self.left_open or ()))

    def profiles(self) -> tuple[Profile, ...]:
        """Return the residual before and after along the coordinates that matter."""
        axes = [effect.along for effect in self.better.effects]
        axes += [self.beyond.best.axis] if self.beyond.significant else []
        axes += ["level of w", "clock time"]
        train, before, after = self.bench.observations, self.plain.fit.chain, self.improved.fit.chain
        made = [profile(axis, before, after, train) for axis in dict.fromkeys(axes)]
        return tuple(p for p in made if p is not None)

    def sentence(self, findings: tuple[Finding, ...]) -> str:
        """Return the verdict in one sentence an operator understands."""
        times = f"{self.before_v / self.noise_v:.3g} times the noise"
        if self.verdict == "consistent":
            doubt = f", but the runs that were fitted leave {named_open(self.left_open)} open" if self.left_open else ""
            values = self.rig_file.told(self.noise_v)
            fitted = " once its values are fitted" if values else ""
            agree = f"Simulation and recordings agree to the noise{fitted}: nothing is missing from the model{doubt}."
            return f"{agree} {values}".rstrip()
        names = listed([called(f) for f in findings if f.id != UNNAMED])
        after = f"{self.after_v / self.noise_v:.3g} times"
        if self.verdict == "explained":
            return f"The mismatch is explained by {names}: the held-out residual falls from {times} to {after}."
        if self.verdict == "partly_explained":
            return f"{names} explains part of the mismatch: the held-out residual falls from {times} to {after}."
        if self.readings.found and self.proof is None:
            what = listed([blemish.title for blemish in self.readings.found])
            return f"The readings have {what}, which nothing in the signal path makes; what does is open."
        if self.proof is None and not self.beyond.significant:
            return f"Held-out runs differ by {times}, the others agree: they show something the others do not excite."
        law = f"; an unnamed law at {self.beyond.place.label} brings that to {after}" if self.proof else ""
        by = f"at single moments, by {times} in all" if isinstance(self.beyond.best, Moments) else f"by {times}"
        return f"The recordings differ from the simulation {by}, and no known physics explains it{law}."
