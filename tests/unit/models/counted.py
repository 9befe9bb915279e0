"""Parameters of networks, as Keras counts them."""


def count_parameters(network):
    """Return how many there are, with what batch normalisation keeps, and how many are trainable.

    The second bias of LSTMs is frozen and not counted: Keras has none.
    """
    trainable = sum(p.numel() for p in network.parameters() if p.requires_grad)
    kept = sum(b.numel() for b in network.buffers() if b.is_floating_point())
    return trainable + kept, trainable


def count_by_layer(network):
    """Return the parameters of each layer that has any; what all frames share counts as one."""
    counts, of_frames = [], hasattr(network, "lstm")
    for name, layer in network.named_modules():
        if name == "lstm":
            weights = [(n[-1], p.numel()) for n, p in layer.named_parameters() if p.requires_grad]
            counts += [sum(n for at, n in weights if at == number) for number in "012"]
        elif of_frames and name.startswith("image"):
            counts += [count_parameters(layer)[0]] * (name == "image")
        elif not list(layer.children()):
            counts.append(count_parameters(layer)[0])
    return [count for count in counts if count]
