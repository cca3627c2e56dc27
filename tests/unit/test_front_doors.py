"""What do `import identify` and `import rig` give, and what does that cost?"""

from types import ModuleType

import pytest

import identify
import rig
from tests.architecture.test_imports import HEAVY, loaded_by


@pytest.mark.parametrize("package", [identify, rig], ids=lambda package: package.__name__)
def test_every_public_name_is_there_and_said_behind_the_dot(package: ModuleType) -> None:
    assert sorted(package.__all__) == sorted(package.HOMES) == sorted(dir(package))
    assert len(package.__all__) <= 12
    for name in package.__all__:
        found = getattr(package, name)
        assert callable(found)
        assert found.__doc__
        assert not isinstance(found, ModuleType)


@pytest.mark.parametrize("package", [identify, rig], ids=lambda package: package.__name__)
def test_another_name_is_answered_with_those_there_are(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=f"{package.__name__} has no 'explian'; it has .*, "):
        package.explian  # noqa: B018


def test_importing_them_loads_nothing_heavy() -> None:
    assert not set(loaded_by("import identify, rig")) & set(HEAVY)
