"""What does an explanation say once every rival that was in doubt before has been fitted to all the data?

An explanation of more data may have passed over what was in doubt on less. Here no member of an earlier set is out of
doubt before it was fitted, from the values it had, on grids fine enough for it, and lost; and where it wins, it takes
the place of what was named.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import exp

from identify.chain import model_of
from identify.effects import physics_in
from identify.effects.effect import short
from identify.explain.confirm import adapted, held_out_rms
from identify.explain.contenders import Contender, contenders
from identify.explain.explanation import Alternative, Explanation, Finding, Residuals
from identify.explain.rivals import MENTIONED
from identify.interval import Interval
from identify.natural_units import shown_interval
from identify.observe import pooled_rms
from identify.uncertainty.inflation import inflation
from identify.unnamed.correction import UNNAMED


def revised(told: Explanation, sets: Sequence[Sequence[Contender]]) -> Explanation:
    """Return the explanation with the members of earlier sets weighed again; ``sets`` were fitted to less data.

    Laws without a name are not: they were the best of what little was there.
    """
    sets = [members for members in sets if not members[0].nameless]
    for finding in [f for f in told.effects if f.id != UNNAMED]:
        earlier = _own(told, finding, sets)
        known = {(o.id, o.stage) for o in finding.could_also_be} | {(finding.id, finding.stage)}
        if any((c.id, c.stage) not in known for c in earlier if c.fit is not None):
            told = _weighed(told, finding, contenders(told, finding, earlier))
    return told


def _own(told: Explanation, finding: Finding, sets: Sequence[Sequence[Contender]]) -> list[Contender]:
    """Return the earlier set a finding was in; where it is new, sets of which no member is named any more."""
    named = {(f.id, f.stage) for f in told.effects}
    members = [{(c.id, c.stage) for c in each} for each in sets]
    own = [k for k, keys in enumerate(members) if (finding.id, finding.stage) in keys]
    own = own or [k for k, keys in enumerate(members) if not named & keys]
    latest = {(c.id, c.stage): c for k in own for c in sets[k]}
    return list(latest.values())


def _weighed(told: Explanation, finding: Finding, members: Sequence[Contender]) -> Explanation:
    """Return the explanation with one set by the odds of its fitted members; exact equals share with the named one."""
    count = sum(o.count for o in told.train)
    tested = [m for m in members if m.fit is not None and not m.exact]
    best = min(tested, key=lambda m: m.price(count))
    odds = {m.label: exp(0.5 * (best.price(count) - m.price(count))) for m in tested}
    whole = sum(o.probability for o in finding.could_also_be if o.id not in {m.id for m in members if m.exact})
    share = (finding.probability + whole) / sum(odds.values())
    others = [m for m in tested if m is not best and share * odds[m.label] > MENTIONED]
    doubts = [Alternative(m.id, m.stage, share * odds[m.label]) for m in others]
    if best is members[0]:
        doubts += [o for o in finding.could_also_be if any(m.exact and m.id == o.id for m in members)]
        told_of = replace(finding, probability=share)
    else:
        told, told_of = _exchanged(told, finding, best, share)
    kept = tuple(sorted(doubts, key=lambda o: -o.probability))
    told_of = replace(told_of, could_also_be=kept)
    return replace(told, effects=tuple(told_of if f is finding else f for f in told.effects))


def _exchanged(told: Explanation, finding: Finding, better: Contender, share: float) -> tuple[Explanation, Finding]:
    """Return the explanation whose model has a better contender in the place of what was named, and its finding."""
    assert better.fit is not None
    assert better.effect is not None
    chain = better.fit.chain
    after = Residuals(told.training.before_v, pooled_rms([o.used_residual(chain) for o in told.train]))
    left_v = held_out_rms(adapted(chain, told.test), told.test)
    held = replace(told.held_out, residuals=Residuals(told.held_out.residuals.before_v, left_v), named_v=left_v)
    model = replace(model_of(chain, told.model), physics=physics_in(chain))
    sentence = told.sentence.replace(f"{finding.id} at {finding.stage}", f"{better.id} at {better.stage}")
    changed = replace(
        told, improved=better.fit, model=model, training=after, held_out=held, sentence=sentence,
        warnings=(*told.warnings, f"{better.label}, in doubt before, fits all the data better than {finding.id}"),
    )  # fmt: skip
    return changed, _finding(told, finding, better, share)


def _finding(told: Explanation, instead_of: Finding, better: Contender, share: float) -> Finding:
    """Return what is said of a contender that won, in the place of what was named."""
    effect, fit = better.effect, better.fit
    assert effect is not None
    assert fit is not None
    wider = inflation(fit.chain, told.train, told.noise.freedom)
    parameters = {
        short(p.name): (Interval(float(fit.chain.values[p.name]), *fit.ci95(p.name, wider)), p.unit)
        for p in effect.parameters() if not p.local
    }  # fmt: skip
    values = ", ".join(f"{name} {shown_interval(interval, unit)}" for name, (interval, unit) in parameters.items())
    return replace(
        instead_of, id=better.id, stage=better.stage, form=effect.form, probability=share, parameters=parameters,
        equation=effect.equation, sentence=effect.sentence.format(values), would_separate=None,
    )  # fmt: skip
