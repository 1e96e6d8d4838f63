"""One question, one answer, one price: language models by name.

    model = connect("anthropic:claude-sonnet-5-5")
    record = model.ask(question)

`connect` knows the large providers, OpenRouter, Ollama and any server that speaks OpenAI's wire format. Provider
libraries are loaded when `connect` is called, never at import.
"""

from aidsr.models.access import Access
from aidsr.models.connecting import connect, key_variables
from aidsr.models.manual import ManualModel
from aidsr.models.model import Model
from aidsr.models.retrying import Clock, Patience

__all__ = ["Access", "Clock", "ManualModel", "Model", "Patience", "connect", "key_variables"]
