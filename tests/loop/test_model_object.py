"""`design(model=…)` with an object of one's own: it is asked, its name is recorded, and resuming needs it again."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

import aidsr
from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.config import Budget
from aidsr.core.errors import ModelError, UserError
from aidsr.runs import read_status


class Parrot:
    """Answers the Designer with one concept and nobody else."""

    name = "parrot"

    def __init__(self, reply: str) -> None:
        self.reply = reply
        self.asked: list[Question] = []

    def ask(self, question: Question) -> CallRecord:
        self.asked.append(question)
        if question.role != "designer":
            raise ModelError("parrot has flown")
        usage = Usage(calls=1, input_tokens=10, output_tokens=5, cost_usd=None)
        started = datetime.now(UTC).isoformat()
        return CallRecord(
            question=question, model=self.name, reply=self.reply, finish="stop", usage=usage, started=started
        )


CONCEPT = """{"interpretation": "A finger that pushes.", "concepts": [{"name": "finger", "morphology": "One finger.",
"actuation": "Two tendons.", "functional_part": "tip", "family": "finger"}]}"""


@pytest.fixture
def stopped(tmp_path: Path) -> aidsr.Run:
    """A run by an object that answered the Designer's question and then could not be reached."""
    return aidsr.design(task="button_pushing", model=Parrot(CONCEPT), concepts=1, runs=tmp_path)


def test_an_object_designs_under_its_name(stopped: aidsr.Run) -> None:
    record = stopped.asked()
    assert (record.config.model, record.model_object) == ("parrot", True)
    assert read_status(stopped).designs[0].state == "stopped"
    assert stopped.calls[0].model == "parrot"


def test_the_run_goes_on_with_the_object_and_repeats_no_answered_call(stopped: aidsr.Run) -> None:
    again = Parrot("never asked")
    aidsr.resume(stopped.path, model=again)
    assert {question.role for question in again.asked} == {"coder"}


def test_the_run_does_not_go_on_without_the_object(stopped: aidsr.Run) -> None:
    with pytest.raises(UserError, match=r'Python object named "parrot".*pass the object: aidsr\.resume'):
        aidsr.resume(stopped)
    with pytest.raises(UserError, match="Python object"):
        aidsr.resume(stopped, budget=Budget(tokens=9))
    with pytest.raises(UserError, match="not by openai:gpt-5; resume it with the same model"):
        aidsr.resume(stopped, model="openai:gpt-5")


class Builtin:
    name = "builtin"

    def ask(self, question: Question) -> CallRecord:
        raise AssertionError(question)


@pytest.mark.parametrize(("model", "sentence"), [(object(), "object is not a model"), (Builtin(), "is reserved")])
def test_what_is_no_model_is_refused(model: object, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=sentence):
        aidsr.design(task="button_pushing", model=model, runs=tmp_path)
    assert not list(tmp_path.iterdir())


def test_money_cannot_be_limited_for_an_object(tmp_path: Path) -> None:
    with pytest.raises(UserError, match='price of "parrot" is unknown'):
        aidsr.design(task="button_pushing", model=Parrot(""), budget=Budget(cost_usd=1), runs=tmp_path)
