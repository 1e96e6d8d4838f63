"""Recorded answers: written at once, given again to the same question, in order."""

import pytest

from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.errors import ModelError
from aidsr.runs import RecordedModel


class Counting:
    """Answers with the number of the question."""

    name = "counting"

    def __init__(self) -> None:
        self.count = 0

    def ask(self, question: Question) -> CallRecord:
        self.count += 1
        return CallRecord(
            question=question,
            model=self.name,
            reply=str(self.count),
            finish="stop",
            usage=Usage(calls=1),
            started="now",
        )


class Unreachable(Counting):
    def ask(self, question: Question) -> CallRecord:
        raise ModelError("no answer")


def question(text: str, role="coder") -> Question:
    return Question(role=role, messages=(Message(role="user", text=text),))


def test_an_answer_is_on_disk_before_it_is_given(tmp_path) -> None:
    record = RecordedModel(Counting(), tmp_path).ask(question("a"))
    assert CallRecord.model_validate_json((tmp_path / "calls" / "0001_coder.json").read_text()) == record


def test_recorded_questions_are_not_asked_again(tmp_path) -> None:
    first = RecordedModel(Counting(), tmp_path)
    asked = [question("a"), question("b", "judge"), question("a"), question("a")]
    replies = [first.ask(each).reply for each in asked]
    assert replies == ["1", "2", "3", "4"]
    model = Counting()
    again = RecordedModel(model, tmp_path)
    assert [again.ask(each).reply for each in asked] == replies
    assert model.count == 0
    assert again.ask(question("a")).reply == "1"
    assert sorted(path.name for path in (tmp_path / "calls").iterdir()) == [
        "0001_coder.json",
        "0002_judge.json",
        "0003_coder.json",
        "0004_coder.json",
        "0005_coder.json",
    ]


@pytest.mark.parametrize(
    "other",
    [
        question("b"),
        question("a", "judge"),
        Question(role="coder", messages=question("a").messages, max_output_tokens=5),
    ],
)
def test_only_exactly_the_same_question_counts(tmp_path, other: Question) -> None:
    RecordedModel(Counting(), tmp_path).ask(question("a"))
    model = Counting()
    RecordedModel(model, tmp_path).ask(other)
    assert model.count == 1


def test_a_failed_call_is_not_recorded(tmp_path) -> None:
    with pytest.raises(ModelError):
        RecordedModel(Unreachable(), tmp_path).ask(question("a"))
    assert not (tmp_path / "calls").exists()


def test_it_has_the_name_of_its_model(tmp_path) -> None:
    assert RecordedModel(Counting(), tmp_path).name == "counting"
