"""What a store's spikes say of texture and speed: `afferents neural`."""

from afferents.pipeline.neural.run import NeuralResults, neural

__all__ = ["NeuralResults", "neural"]
