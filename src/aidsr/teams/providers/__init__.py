"""One question, one answer, one price: language models by name.

    model = connect("anthropic:claude-sonnet-5-5")
    record = model.ask(question)

`connect` knows the large providers, OpenRouter, Ollama and any server that speaks OpenAI's wire format. Provider
libraries are loaded when `connect` is called, never at import.
"""

from aidsr.core.model import Model
from aidsr.teams.providers.connect import connect, key_variables
from aidsr.teams.providers.credentials import Access
from aidsr.teams.providers.manual import ManualModel
from aidsr.teams.providers.retry import Clock, Patience

__all__ = ["Access", "Clock", "ManualModel", "Model", "Patience", "connect", "key_variables"]
