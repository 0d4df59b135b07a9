"""Reports and pictures of results, one file a subject: a result to a `Document`."""
