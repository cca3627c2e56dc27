"""Why do simulation and recording differ? Fit, locate, select, earn the names, confirm: the whole way in order."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from identify.chain import Chain, model_of
from identify.effects import catalogue, chain_of, physics_in
from identify.effects.effect import Effect, short
from identify.explain.confirm import CONVINCING, adapted, held_out_rms, improvement
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
from identify.explain.locate import Located
from identify.explain.rivals import odds
from identify.explain.select import Bench, Hypothesis, Round, selected
from identify.explain.warrant import Warranted, warranted
from identify.explain.where import acting, profile
from identify.holdout import Split, split
from identify.interval import Interval
from identify.model import Model
from identify.observe import Observation, pooled_rms, refined
from identify.trace import Intersample, Trace
from identify.wording import listed, spoken, spoken_with_interval

TO_THE_NOISE = 1.1  # a held-out residual below this many times the noise counts as explained
Note = Callable[[str, float], None]


def explain(
    model: Model, traces: Sequence[Trace], hold_out: Sequence[Trace] = (), progress: Note | None = None
) -> Explanation:
    """Return where simulation and recordings differ, what physics was left out, the better model, and the proof.

    Raises ValueError with one sentence when the recordings cannot be used.
    """
    with threadpool_limits(1, "blas"):  # the matrices are small: threads only wait for each other
        return _explained(model, split(model, traces, hold_out), progress or _silent)


def _explained(model: Model, data: Split, note: Note) -> Explanation:
    """Go the whole way with data already split."""
    note("fitting the plain model", 0.02)
    bench, plain = prepared(model, data)
    bench, final, rounds = selected(bench, plain, note)
    note("checking the names against free-form corrections", 0.75)
    plain = bench.fitted(plain.fit.chain, ())
    earned = warranted(bench, plain, final, rounds)
    note("confirming on held-out data", 0.9)
    data = replace(data, test=tuple(refined(o, earned.hypothesis.fit.chain) for o in data.test))
    kept, dropped = confirmed(bench, earned, data.test)
    note("done", 1.0)
    return _Answer(model, data, bench, plain, kept, rounds, dropped).explanation()


def _silent(sentence: str, share: float) -> None:
    """Show nothing."""


def prepared(model: Model, data: Split) -> tuple[Bench, Hypothesis]:
    """Return the bench of hypotheses and the fitted plain model, on grids fine enough for it."""
    chain = chain_of(model, intersample_of([o.trace for o in data.train]))
    bench = Bench(chain, data.train, model.fixed, tuple(catalogue().values()))
    coarse = bench.fitted(chain, ())
    bench = bench.refined(coarse.fit.chain)
    return bench, bench.fitted(coarse.fit.chain, ())


def intersample_of(traces: Sequence[Trace]) -> Intersample:
    """Return what u is between samples; ValueError when recordings differ in it."""
    kinds = {trace.intersample for trace in traces}
    if len(kinds) > 1:
        raise ValueError(f"recordings with {' and '.join(sorted(kinds))} inputs cannot be fitted together")
    return next(iter(kinds))


def confirmed(
    bench: Bench, earned: Warranted, test: Sequence[Observation]
) -> tuple[Warranted, tuple[Effect, ...]]:
    """Drop effects that do not make held-out data fit better; return what is left and what was dropped."""
    hypothesis, dropped = earned.hypothesis, []
    for effect in earned.hypothesis.effects:
        without = bench.without(hypothesis, effect)
        better, worse = adapted(hypothesis.fit.chain, test), adapted(without.fit.chain, test)
        if improvement(better, worse, test) < CONVINCING:
            hypothesis = without
            dropped.append(effect)
    return replace(earned, hypothesis=hypothesis), tuple(dropped)


class _Answer:
    """All that the answer is written from."""

    def __init__(
        self, model: Model, data: Split, bench: Bench, plain: Hypothesis, earned: Warranted, rounds: list[Round],
        dropped: tuple[Effect, ...],
    ) -> None:
        """Simulate the held-out data with the plain and the better model."""
        self.model, self.data, self.bench, self.rounds, self.dropped = model, data, bench, rounds, dropped
        self.plain, self.better, self.beyond = plain, earned.hypothesis, earned.beyond
        self.noise_v = data.noise.rms_v
        self.inflation = inflation(self.better, bench.observations)
        self.before_v = held_out_rms(adapted(plain.fit.chain, data.test), data.test)
        self.after_v = held_out_rms(adapted(self.better.fit.chain, data.test), data.test)
        self.unnamed = self._unnamed() if not self.better.effects else None

    @property
    def verdict(self) -> Verdict:
        """Return one of the four verdicts."""
        if self.better.effects:
            return "explained" if self.after_v <= TO_THE_NOISE * self.noise_v else "partly_explained"
        if self.beyond.significant or self.before_v > TO_THE_NOISE * self.noise_v:
            return "unexplained"
        return "consistent"

    def explanation(self) -> Explanation:
        """Return the answer."""
        model = replace(
            model_of(self.better.fit.chain, self.model), noise_v=self.noise_v,
            physics=physics_in(self.better.fit.chain),
        )  # fmt: skip
        findings = tuple(self.finding(effect) for effect in self.better.effects)
        train = self.bench.observations
        before = pooled_rms([o.used_residual(self.plain.fit.chain) for o in train])
        after = pooled_rms([o.used_residual(self.better.fit.chain) for o in train])
        return Explanation(
            verdict=self.verdict, sentence=self.sentence(findings), noise=self.data.noise, mismatch_v=before,
            p_value=self.p_value, location=self.location(), effects=(*findings, *([self.unnamed] if self.unnamed else [])),
            training=Residuals(before, after),
            held_out=HeldOut(
                tuple(o.trace.name for o in self.data.test), self.data.how, Residuals(self.before_v, self.after_v)
            ),
            remaining=self.remaining(), model=model, plain=self.plain.fit, improved=self.better.fit,
            train=train, test=self.data.test, profiles=self.profiles(), warnings=tuple(self.warnings()),
        )  # fmt: skip

    @property
    def p_value(self) -> float:
        """Return how likely noise alone would make the mismatch; zero once physics was found in it."""
        return 0.0 if self.better.effects else self.beyond.p_value

    def without(self, effect: Effect) -> Chain:
        """Return the better model's chain less one effect, all other values as they are."""
        rest = tuple(e for e in self.better.effects if e is not effect)
        return self.bench.with_effects(rest, self.better.fit.chain.values)

    def finding(self, effect: Effect) -> Finding:
        """Return what is said of one effect."""
        probability, others = odds(self.bench, self.better, effect, self.rounds)
        parameters = self.parameters(effect)
        values = listed(
            [f"{name} {spoken_with_interval(i.value, i.low, i.high, unit)}" for name, (i, unit) in parameters.items()]
        )
        separators = {c.id: c.would_separate for c in effect.confused_with}
        first = next((separators[o.id] for o in others if o.id in separators), None)
        return Finding(
            effect.id, effect.place.label, effect.form, probability, parameters, effect.equation,
            effect.sentence.format(values), others, first or next(iter(separators.values()), None),
        )  # fmt: skip

    def parameters(self, effect: Effect) -> dict[str, tuple[Interval, str]]:
        """Return an effect's shared parameters with intervals and units, by short name."""
        found = {}
        for p in effect.parameters():
            if not p.local:
                value = float(self.better.fit.chain.values[p.name])
                found[short(p.name)] = (Interval(value, *self.better.fit.ci95(p.name, self.inflation)), p.unit)
        return found

    def location(self) -> Location | None:
        """Return the stage at which the mismatch enters and the stretch of its coordinate that holds it."""
        if self.better.effects:
            return self._location_of_effects()
        return self._location_of_correction() if self.beyond.significant else None

    def _location_of_effects(self) -> Location:
        train = self.bench.observations
        ranges = {e: acting(e.axis, e.place, self.better.fit.chain, self.without(e), train) for e in self.better.effects}
        stage = self.better.effects[0].place.label
        lines = [
            f"{e.place.label}, where {e.title} acts at {found[0].axis} {listed([_stretch(r) for r in found])}"
            for e, found in ranges.items()
        ]
        every = tuple(r for found in ranges.values() for r in found)
        return Location(stage, every, f"The mismatch enters at {'; and at '.join(lines)}.")

    def _location_of_correction(self) -> Location:
        correction, fitted = self.beyond.fitted[0]
        base = self.beyond.base.fit.chain
        others = tuple(place.label for place in self.beyond.alternatives())
        ranges = (
            ()
            if correction.axis == "branch"
            else acting(correction.axis, correction.place, fitted.fit.chain, base, self.bench.observations)
        )
        also = f"; a correction at {listed(list(others))} would do nearly as well" if others else ""
        return Location(correction.place.label, ranges, f"{_described(self.beyond)}{also}.", others)

    def _unnamed(self) -> Finding | None:
        """Return the finding without a name, when a correction proves itself on held-out data."""
        if not self.beyond.significant:
            return None
        correction, fitted = self.beyond.fitted[0]
        test = self.data.test
        with_it = adapted(fitted.fit.chain, test)
        if improvement(with_it, adapted(self.plain.fit.chain, test), test) < CONVINCING:
            return None
        after = held_out_rms(with_it, test)
        return Finding(
            "unnamed", correction.place.label, "", min(1.0, self.beyond.share), {},
            f"a free-form correction along {correction.axis}: {correction.kind}",
            f"{_described(self.beyond)}; on held-out data it lowers the residual from {spoken(self.before_v, 'V', 3)} to "
            f"{spoken(after, 'V', 3)}. No physics in the catalogue explains this shape.",
            (), None,
        )  # fmt: skip

    def remaining(self) -> Remaining:
        """Return what the better model leaves on held-out data."""
        over = self.after_v / self.noise_v
        if not self.beyond.significant:
            return Remaining(over, None, "Nothing that any correction could explain is left beyond the noise.")
        if not self.better.effects:
            return Remaining(over, self.beyond.best.place.label, "The mismatch is not explained; it is located above.")
        return Remaining(over, self.beyond.best.place.label, f"{_described(self.beyond)}.")

    def profiles(self) -> tuple[Profile, ...]:
        """Return the residual before and after along the coordinates that matter."""
        axes = [effect.axis for effect in self.better.effects]
        axes += [self.beyond.best.axis] if self.beyond.significant else []
        axes += ["level of w", "clock time"]
        train, before, after = self.bench.observations, self.plain.fit.chain, self.better.fit.chain
        made = [profile(axis, before, after, train) for axis in dict.fromkeys(axes)]
        return tuple(p for p in made if p is not None)

    def sentence(self, findings: tuple[Finding, ...]) -> str:
        """Return the verdict in one sentence an operator understands."""
        times = f"{self.before_v / self.noise_v:.3g} times the noise"
        if self.verdict == "consistent":
            return "Simulation and recordings agree to the noise: nothing is missing from the model."
        names = listed([f"{f.id} at {f.stage}" for f in findings])
        after = f"{self.after_v / self.noise_v:.3g} times"
        if self.verdict == "explained":
            return f"The mismatch is explained by {names}: the held-out residual falls from {times} to {after}."
        if self.verdict == "partly_explained":
            return f"{names} explains part of the mismatch: the held-out residual falls from {times} to {after}."
        if self.unnamed is None and not self.beyond.significant:
            return f"Held-out runs differ by {times}, the others agree: they show something the others do not excite."
        return f"The recordings differ from the simulation by {times}, and no known physics explains it."

    def warnings(self) -> list[str]:
        """Return what the reader must know beside the answer."""
        found = [
            f"{effect.id} at {effect.place.label} fits the training runs but is not confirmed by the held-out data: it is "
            "not reported; hold out runs that reach it"
            for effect in self.dropped
        ]
        if not self.plain.fit.converged:
            found.append(f"the plain fit did not converge: {self.plain.fit.sentence}")
        if not self.better.fit.converged:
            found.append(f"the improved fit did not converge: {self.better.fit.sentence}")
        return found


def _stretch(part: Range) -> str:
    """Return a stretch of a coordinate in words."""
    return f"{spoken(part.low, part.unit, 3)} to {spoken(part.high, part.unit, 3)} ({100 * part.share:.0f} % of it)"


def _described(beyond: Located) -> str:
    """Return what the best correction says."""
    best = beyond.best
    return f"{best.kind} at {best.place.label} along {best.axis} accounts for {100 * min(beyond.share, 1.0):.0f} % of the misfit"


def inflation(hypothesis: Hypothesis, observations: Sequence[Observation]) -> float:
    """Return the factor by which intervals widen because the residual is larger than noise, or hangs together.

    The variance of sums over stretches of several lengths is compared with that of white noise of the known size.
    """
    found = [1.0, hypothesis.chi2 / hypothesis.count]
    residuals = [o.used_residual(hypothesis.fit.chain) / o.noise_v for o in observations]
    for length in (10, 100, 1000):
        sums = [r[: r.size // length * length].reshape(-1, length).sum(axis=1) for r in residuals]
        joined = np.concatenate(sums)
        if joined.size >= 30:
            found.append(float(np.mean(np.square(joined))) / length)
    return float(np.sqrt(max(found)))
