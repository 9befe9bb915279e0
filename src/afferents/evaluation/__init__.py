"""Trainings with one group held out, by default a speed; results on disk, accuracies.

Its files, from the lowest floor up; each imports from those before it alone::

    results, intervals          the models of a results folder's files; how sure an accuracy is
    options, data, fold_files   what can be chosen; what is learnt from; the folder as it fills
    metrics, plan, controls     the numbers; what is evaluated; what rests on something else
    run, train                  all folds of an evaluation; one model to keep
    evaluate                    what Python and the shell call
"""
